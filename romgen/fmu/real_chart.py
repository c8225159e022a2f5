"""The chart y/s = Re(T zeta^E) as a real polynomial of (Re z_1..Re z_m, Im z_1..Im z_m), and back."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.fmu.programme import Exponent, fold_conjugates
from romgen.polynomial import PolynomialMap

Factors = tuple[tuple[complex, complex], tuple[complex, complex]]

REAL_PARTS: Factors = ((1.0, 1.0j), (1.0, -1.0j))
"""z = x + i y and conj z = x - i y."""

CONJUGATES: Factors = ((0.5, 0.5), (-0.5j, 0.5j))
"""x = (z + conj z) / 2 and y = (z - conj z) / 2i."""


def real_chart(chart: PolynomialMap[np.complex128]) -> PolynomialMap[np.float64]:
    """Re(T zeta^E) as C (Re z, Im z)^E', which has as many real coefficients and no complex products.

    Which monomials there are depends on the exponents alone.
    """
    folded = fold_conjugates(chart)
    exponents, coefficients = _substituted(folded.exponents, folded.coefficients, REAL_PARTS)
    return PolynomialMap(exponents, coefficients.real)


def complex_chart(real: PolynomialMap[np.float64], exponents: IntArray) -> PolynomialMap[np.complex128]:
    """The chart that ``real_chart`` was made from, to rounding.

    Parameters
    ----------
    real : polynomial of (Re z, Im z).
    exponents : (n_term, 2m) of the folded chart.
    """
    folded = fold_conjugates(PolynomialMap(*_substituted(real.exponents, real.coefficients, CONJUGATES)))
    column = {tuple(row): c for row, c in zip(folded.exponents.tolist(), folded.coefficients.T, strict=True)}
    return PolynomialMap(exponents, np.stack([column[tuple(row)] for row in exponents.tolist()], axis=1))


def _substituted(
    exponents: IntArray, coefficients: FloatArray | ComplexArray, factors: Factors
) -> tuple[IntArray, ComplexArray]:
    """Put linear factors in two other variables for the pair (j, m + j) of variables, for each j."""
    terms: dict[Exponent, ComplexArray] = {}
    for row, c in zip(exponents.tolist(), coefficients.T, strict=True):
        for exponent, weight in _expanded(row, factors):
            terms[exponent] = terms.get(exponent, np.zeros(len(c), dtype=np.complex128)) + weight * c
    rows = sorted(terms, key=lambda e: (sum(e), e))
    return np.array(rows, dtype=np.int64), np.stack([terms[row] for row in rows], axis=1)


def _expanded(row: Sequence[int], factors: Factors) -> Iterator[tuple[Exponent, complex]]:
    """Monomials that one becomes, with their weights: for each pair those of prod_k (f_k0 + f_k1 t)^e_k."""
    m = len(row) // 2
    weights = [_weights([factors[0]] * row[j] + [factors[1]] * row[m + j]) for j in range(m)]
    for q in itertools.product(*map(np.flatnonzero, weights)):
        first = tuple(len(weight) - 1 - int(k) for weight, k in zip(weights, q, strict=True))
        value = math.prod(complex(weight[k]) for weight, k in zip(weights, q, strict=True))
        yield (*first, *map(int, q)), value


def _weights(factors: Sequence[tuple[complex, complex]]) -> ComplexArray:
    """Coefficients of a product of linear factors f_0 + f_1 t, by power of t."""
    product = np.ones(1, dtype=np.complex128)
    for factor in factors:
        product = np.convolve(product, factor)
    return product
