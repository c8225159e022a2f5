"""Monomials as a list of products: each one is two earlier ones multiplied."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import IntArray
from romgen.errors import InputError
from romgen.polynomial import PolynomialMap

Exponent = tuple[int, ...]


@dataclass(frozen=True)
class MonomialProgramme:
    """p_k = x_k for k < n_var, p_{n_var + k} = p_{left_k} p_{right_k}.

    Attributes
    ----------
    n_var : number of variables.
    products : (n_product, 2) left and right factor of each further monomial.
    index : position of every monomial by its exponents.
    """

    n_var: int
    products: IntArray = field(metadata={"unit": "1", "axes": "product,factor"})
    index: dict[Exponent, int]

    @property
    def n_monomial(self) -> int:
        """Number of monomials, the variables included."""
        return self.n_var + len(self.products)


def monomial_programme(exponents: IntArray) -> MonomialProgramme:
    """Order the monomials of an exponent table so that each is one product of earlier ones.

    Parameters
    ----------
    exponents : (n_term, n_var) non-negative, no row of zeros.

    Raises
    ------
    InputError : for a constant term, which no map of a structure about its rest state has.
    """
    n_var = exponents.shape[1]
    rows = sorted({tuple(int(e) for e in row) for row in exponents}, key=lambda e: (sum(e), e))
    if rows and sum(rows[0]) == 0:
        raise InputError(
            "a polynomial has a constant term", where="FMU export", advice="shift the model to its rest state"
        )
    index = {tuple(int(i == j) for i in range(n_var)): j for j in range(n_var)}
    products: list[tuple[int, int]] = []
    for row in rows:
        _append(row, index, products)
    return MonomialProgramme(n_var, np.array(products, dtype=np.int64).reshape(-1, 2), index)


def _append(exponent: Exponent, index: dict[Exponent, int], products: list[tuple[int, int]]) -> int:
    """Position of a monomial, appended (with the factors it needs) if it is new."""
    if exponent not in index:
        last = max(j for j, e in enumerate(exponent) if e)
        factor = tuple(e - (j == last) for j, e in enumerate(exponent))
        left = _append(factor, index, products)
        products.append((left, last))
        index[exponent] = len(index)
    return index[exponent]


def fold_conjugates(chart: PolynomialMap[np.complex128]) -> PolynomialMap[np.complex128]:
    """Halve a map whose real part is taken: Re(c p + d conj p) = Re((c + conj d) p).

    The variables are (z_1..z_m, conj z_1..conj z_m), so swapping the halves of an exponent conjugates its monomial.
    """
    m = chart.exponents.shape[1] // 2
    folded: dict[Exponent, np.ndarray[tuple[int], np.dtype[np.complex128]]] = {}
    for k, row in enumerate(chart.exponents):
        own = tuple(int(e) for e in row)
        conjugate = own[m:] + own[:m]
        kept = max(own, conjugate)
        c = chart.coefficients[:, k]
        folded[kept] = folded.get(kept, np.zeros_like(c)) + (c if kept == own else c.conj())
    exponents = np.array(sorted(folded, key=lambda e: (sum(e), e)), dtype=np.int64)
    coefficients = np.stack([folded[tuple(int(e) for e in row)] for row in exponents], axis=1)
    return PolynomialMap(exponents, coefficients)
