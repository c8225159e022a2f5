"""Monomials as a list of products: each one is two earlier ones multiplied."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, IntArray
from romgen.polynomial import PolynomialMap

Exponent = tuple[int, ...]


@dataclass(frozen=True)
class MonomialProgramme:
    """p_0 = 1, then the variables, then p_left p_right for each product.

    Attributes
    ----------
    n_var : number of variables.
    products : (n_product, 2) positions of the two factors, both before the product.
    index : position of every monomial by its exponents.

    Monomials are ordered by degree, so that those up to a degree are the first ones.
    """

    n_var: int
    products: IntArray = field(metadata={"unit": "1", "axes": "product,factor"})
    index: dict[Exponent, int]

    @property
    def n_monomial(self) -> int:
        """Number of monomials, 1 and the variables included."""
        return len(self.index)


def monomial_programme(exponents: IntArray) -> MonomialProgramme:
    """Order the monomials of an exponent table, with those that they are made of.

    A product's factors are the two halves of its variables written out, x_1 x_1 | x_1 x_2 x_2: as few products as in a
    chain for full tables, but only log2(degree) of them wait for one another.

    Parameters
    ----------
    exponents : (n_term, n_var) non-negative; a row of zeros is the monomial 1.
    """
    n_var = exponents.shape[1]
    unit = [tuple(int(i == j) for i in range(n_var)) for j in range(n_var)]
    needed = {made for row in exponents for made in _made_of(tuple(int(e) for e in row))}
    made_up = sorted(needed.difference(unit), key=lambda row: (sum(row), [-e for e in row]))
    index = {row: k for k, row in enumerate([(0,) * n_var, *unit, *made_up])}
    products = [[index[half] for half in _halves(row)] for row in made_up]
    return MonomialProgramme(n_var, np.array(products, dtype=np.int64).reshape(-1, 2), index)


def conjugate_programme(exponents: IntArray) -> MonomialProgramme:
    """The same for the variables (z_1..z_m, conj z_1..conj z_m), with every monomial followed by its conjugate.

    The order is 1, 1, z_1, conj z_1, .., z_m, conj z_m, then each product and its conjugate, which needs no product of
    its own. A monomial that two earlier ones make is made of these, of the most equal degrees; those of a resonance
    seldom need others.

    Parameters
    ----------
    exponents : (n_term, 2m) non-negative, without z_j conj z_j in one row.
    """
    n_var = exponents.shape[1]
    m = n_var // 2
    one, *unit = [tuple(int(i == j) for i in range(n_var)) for j in (-1, *range(m))]
    index: dict[Exponent, int] = {one: 0}
    products: list[tuple[int, int]] = []

    def add(row: Exponent) -> None:
        index[row] = len(index) + 1  # 1, which is its own conjugate, stands for two
        index[row[m:] + row[:m]] = index[row] + 1

    def provide(row: Exponent) -> None:
        if row in index:
            return
        pair = _earlier_pair(row, index)
        if pair is None:
            for half in _halves(row):
                provide(half)
            pair = _halves(row)
        products.append((index[pair[0]], index[pair[1]]))
        add(row)

    for row in unit:
        add(row)
    for row in sorted({tuple(row) for row in exponents.tolist()}, key=lambda row: (sum(row), [-e for e in row])):
        provide(row)
    return MonomialProgramme(n_var, np.array(products, dtype=np.int64).reshape(-1, 2), index)


def _earlier_pair(row: Exponent, index: dict[Exponent, int]) -> tuple[Exponent, Exponent] | None:
    """Two monomials of the index whose product is ``row``, of the most equal degrees."""
    earlier = np.array(list(index), dtype=np.int64)
    factors = earlier[np.all(earlier <= row, axis=1)]
    pairs = [(tuple(a), tuple(b)) for a, b in zip(factors.tolist(), (row - factors).tolist(), strict=True)]
    known = [(a, b) for a, b in pairs if b in index]
    return min(known, key=lambda pair: max(map(sum, pair)), default=None)


def _made_of(exponent: Exponent) -> Iterator[Exponent]:
    """A monomial and all products that it is made of."""
    if sum(exponent) > 0:
        yield exponent
    if sum(exponent) > 1:
        for half in _halves(exponent):
            yield from _made_of(half)


def _halves(exponent: Exponent) -> tuple[Exponent, Exponent]:
    """Its variables written out, cut in the middle."""
    left = sum(exponent) // 2
    first: list[int] = []
    for e in exponent:
        first.append(min(e, left))
        left -= first[-1]
    return tuple(first), tuple(e - f for e, f in zip(exponent, first, strict=True))


def fold_conjugates(chart: PolynomialMap[np.complex128]) -> PolynomialMap[np.complex128]:
    """Halve a map whose real part is taken: Re(c p + d conj p) = Re((c + conj d) p).

    The variables are (z_1..z_m, conj z_1..conj z_m), so swapping the halves of an exponent conjugates its monomial; one
    that is its own conjugate is real, and so is what counts of its coefficient.
    """
    m = chart.exponents.shape[1] // 2
    folded: dict[Exponent, ComplexArray] = {}
    for k, row in enumerate(chart.exponents):
        own = tuple(int(e) for e in row)
        conjugate = own[m:] + own[:m]
        kept = max(own, conjugate)
        c = chart.coefficients[:, k]
        part = c.real if own == conjugate else c if kept == own else c.conj()
        folded[kept] = folded.get(kept, np.zeros_like(c)) + part
    exponents = np.array(sorted(folded, key=lambda e: (sum(e), e)), dtype=np.int64)
    coefficients = np.stack([folded[tuple(int(e) for e in row)] for row in exponents], axis=1)
    return PolynomialMap(exponents, coefficients)
