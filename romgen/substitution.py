"""Linear change of variables inside a polynomial: the coefficients of p(L x)."""

from __future__ import annotations

import numpy as np

from romgen.arrays import ComplexArray, IntArray
from romgen.polynomial import PolynomialMap, exponents


def substitute_linear(p: PolynomialMap[np.complex128], L: ComplexArray) -> PolynomialMap[np.complex128]:
    """Return the coefficients of x -> p(L x) over all monomials of degree 1..max degree of p.

    Each monomial of L x is the previous one times one linear form, so the expansion is exact.

    Parameters
    ----------
    p : over n_var variables, degrees >= 1.
    L : (n_var, n_new).
    """
    n_var, n_new = L.shape
    highest = int(p.exponents.sum(axis=1).max())
    rows: list[ComplexArray] = []
    expanded = {(0,) * n_var: np.ones(1, dtype=np.complex128)}
    wanted = {tuple(row): column for row, column in zip(p.exponents.tolist(), p.coefficients.T, strict=True)}
    for degree in range(1, highest + 1):
        shift = _shifts(n_new, degree)
        expanded = {
            tuple(row): _times_form(row, expanded, L, shift) for row in exponents(n_var, degree, degree).tolist()
        }
        total = np.zeros((len(p.coefficients), shift.max() + 1), dtype=np.complex128)
        for row, coefficients in expanded.items():
            if row in wanted:
                total += np.outer(wanted[row], coefficients)
        rows.append(total)
    return PolynomialMap(exponents(n_new, 1, highest), np.hstack(rows))


def _times_form(
    row: list[int], lower: dict[tuple[int, ...], ComplexArray], L: ComplexArray, shift: IntArray
) -> ComplexArray:
    """Return the expansion of a monomial of L x: that of the monomial without its first variable, times that form."""
    first = next(i for i, power in enumerate(row) if power > 0)
    previous = lower[tuple(power - (i == first) for i, power in enumerate(row))]
    product = np.zeros(shift.max() + 1, dtype=np.complex128)
    for variable, target in enumerate(shift):
        product[target] += L[first, variable] * previous
    return product


def _shifts(n_var: int, degree: int) -> IntArray:
    """Return (n_var, n_lower): the index among degree ``degree`` of x_i times each monomial of degree - 1."""
    index = {tuple(row): k for k, row in enumerate(exponents(n_var, degree, degree).tolist())}
    lower = exponents(n_var, degree - 1, degree - 1)
    step = np.eye(n_var, dtype=np.int64)
    return np.array([[index[tuple(row)] for row in (lower + step[i]).tolist()] for i in range(n_var)])
