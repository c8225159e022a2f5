"""Monomials as a list of products: each one is two earlier ones multiplied."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import IntArray
from romgen.errors import InputError
from romgen.polynomial import PolynomialMap

Exponent = tuple[int, ...]


@dataclass(frozen=True)
class MonomialProgramme:
    """p_k = x_k for k < n_var, then p_left p_right for each product, then p_left abs(x_mode)^2 for each pair.

    Attributes
    ----------
    n_var : number of variables.
    products : (n_product, 2) left and right factor; the right one is a variable.
    pairs : (n_pair, 2) left factor and number of the variable that stands in it with its conjugate, once more.
    index : position of every monomial by its exponents.

    Products are ordered by degree, then by their variables written out from the last to the first: those that are
    earlier ones times the same variable follow each other in the order of these earlier ones, in few long runs.
    """

    n_var: int
    products: IntArray = field(metadata={"unit": "1", "axes": "product,factor"})
    pairs: IntArray = field(metadata={"unit": "1", "axes": "pair,factor"})
    index: dict[Exponent, int]

    @property
    def n_monomial(self) -> int:
        """Number of monomials, the variables included."""
        return self.n_var + len(self.products) + len(self.pairs)

    @property
    def runs(self) -> tuple[tuple[int, int, int], ...]:
        """(left, factor, count): count products that follow each other, of left, left + 1, ... and one variable.

        All that a run reads lies before what it writes: powers of one variable, which a table may hold without the
        others, are runs of their own.
        """
        runs: list[tuple[int, int, int]] = []
        first = self.n_var  # position of what the last run writes
        for position, (left, factor) in enumerate(self.products.tolist(), self.n_var):
            if runs and factor == runs[-1][1] and left == runs[-1][0] + runs[-1][2] and left < first:
                runs[-1] = (runs[-1][0], factor, runs[-1][2] + 1)
            else:
                runs.append((left, factor, 1))
                first = position
        return tuple(runs)


def monomial_programme(exponents: IntArray) -> MonomialProgramme:
    """Order the monomials of an exponent table so that each is one product of earlier ones.

    Parameters
    ----------
    exponents : (n_term, n_var) non-negative, no row of zeros.

    Raises
    ------
    InputError : for a constant term, which no map of a structure about its rest state has.
    """
    return _programme(exponents, 0)


def complex_programme(exponents: IntArray) -> MonomialProgramme:
    """The same for the variables (z_1..z_m, conj z_1..conj z_m), where z_j conj z_j = abs(z_j)^2 is real.

    A complex number times a real one takes a third of the work of a complex product, and what is left over after taking
    these pairs out is a small part of the table.

    Parameters
    ----------
    exponents : (n_term, 2 m) non-negative, no row of zeros.

    Raises
    ------
    InputError : for a constant term.
    """
    return _programme(exponents, exponents.shape[1] // 2)


def _programme(exponents: IntArray, m: int) -> MonomialProgramme:
    n_var = exponents.shape[1]
    rows = {tuple(int(e) for e in row) for row in exponents}
    if any(sum(row) == 0 for row in rows):
        raise InputError(
            "a polynomial has a constant term", where="FMU export", advice="shift the model to its rest state"
        )
    needed = {earlier for row in rows for earlier in _chain(row, m) if sum(earlier) > 1}
    index = {tuple(int(i == j) for i in range(n_var)): j for j in range(n_var)}
    products: list[tuple[int, int]] = []
    pairs: list[tuple[int, int]] = []
    for row in sorted(needed, key=lambda row: (_pair(row, m) is not None, *_word(row))):
        left, mode = index[_earlier(row, m)], _pair(row, m)
        index[row] = len(index)
        if mode is None:
            products.append((left, _last(row)))
        else:
            pairs.append((left, mode))
    return MonomialProgramme(n_var, _two_columns(products), _two_columns(pairs), index)


def _two_columns(rows: list[tuple[int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def _last(exponent: Exponent) -> int:
    return max(j for j, e in enumerate(exponent) if e)


def _pair(exponent: Exponent, m: int) -> int | None:
    """A variable that stands in a monomial with its conjugate, and something besides; None where there is none."""
    both = (j for j in range(m) if exponent[j] and exponent[m + j])
    return next(both, None) if sum(exponent) > 2 else None


def _earlier(exponent: Exponent, m: int) -> Exponent:
    """The monomial without its pair, or without its last variable."""
    mode = _pair(exponent, m)
    removed = {_last(exponent)} if mode is None else {mode, m + mode}
    return tuple(e - (j in removed) for j, e in enumerate(exponent))


def _chain(exponent: Exponent, m: int) -> Iterator[Exponent]:
    """A monomial and all that it is made of."""
    while sum(exponent) > 0:
        yield exponent
        exponent = _earlier(exponent, m)


def _word(exponent: Exponent) -> tuple[int, tuple[int, ...]]:
    """Degree, and the variables of a monomial written out, the last one first."""
    return sum(exponent), tuple(j for j in reversed(range(len(exponent))) for _ in range(exponent[j]))


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
