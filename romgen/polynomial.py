"""Multivariate polynomials as exponent tables and coefficient matrices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar, overload

import numpy as np
import numpy.typing as npt

from romgen.arrays import ComplexArray, FloatArray, IntArray

Scalar = TypeVar("Scalar", np.float64, np.complex128)


@dataclass(frozen=True)
class PolynomialMap(Generic[Scalar]):
    """A polynomial map p(x) = C x^E with one monomial per row of E.

    x^E has entries prod_i x_i^E[k, i].

    Attributes
    ----------
    exponents : (n_term, n_var) int
    coefficients : (n_out, n_term) real or complex
    """

    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    coefficients: npt.NDArray[Scalar] = field(metadata={"unit": "mixed", "axes": "output,term"})


def exponents(n_var: int, min_order: int, max_order: int) -> IntArray:
    """Return all exponents of total degree min_order..max_order, graded, x_1 first.

    Two variables, degrees 2 to 3: x1^2, x1 x2, x2^2, x1^3, x1^2 x2, x1 x2^2, x2^3.

    Returns
    -------
    (n_term, n_var) int; no rows where max_order < min_order.
    """
    rows = [row for degree in range(min_order, max_order + 1) for row in _of_degree(n_var, degree)]
    return np.array(rows, dtype=np.int64).reshape(-1, n_var)


def _of_degree(n_var: int, degree: int) -> list[tuple[int, ...]]:
    if n_var == 1:
        return [(degree,)]
    return [(first, *rest) for first in range(degree, -1, -1) for rest in _of_degree(n_var - 1, degree - first)]


def monomials(x: npt.NDArray[Scalar], exponents: IntArray) -> npt.NDArray[Scalar]:
    """Return x^E, entries prod_i x_i^E[k, i].

    Parameters
    ----------
    x : (n_time, n_var) real or complex.
    exponents : (n_term, n_var).

    Returns
    -------
    (n_time, n_term), column-major, of the type of x.
    """
    n_time, n_var = x.shape
    powers = [_powers(x[:, i], int(exponents[:, i].max(initial=0))) for i in range(n_var)]
    phi = np.ones((len(exponents), n_time), dtype=x.dtype)
    for column, row in zip(phi, exponents, strict=True):
        for i in np.flatnonzero(row):
            column *= powers[i][row[i]]
    return phi.T


def _powers(x: npt.NDArray[Scalar], degree: int) -> list[npt.NDArray[Scalar]]:
    powers = [np.ones_like(x)]
    for _ in range(degree):
        powers.append(powers[-1] * x)
    return powers


def monomial_gradient(x: npt.NDArray[Scalar], exponents: IntArray, variable: int) -> npt.NDArray[Scalar]:
    """Return d x^E / d x_variable, (n_time, n_term), for x (n_time, n_var)."""
    power = exponents[:, variable]
    lowered = exponents.copy()
    lowered[:, variable] = np.maximum(power - 1, 0)
    return monomials(x, lowered) * power


def monomial_rate(x: npt.NDArray[Scalar], x_dot: npt.NDArray[Scalar], exponents: IntArray) -> npt.NDArray[Scalar]:
    """Return d/dt x^E = sum_i (d x^E / d x_i) x_i', (n_time, n_term), for x and x_dot (n_time, n_var)."""
    rate = np.zeros((len(x), len(exponents)), dtype=x.dtype, order="F")
    for i in range(x.shape[1]):
        rate += monomial_gradient(x, exponents, i) * x_dot[:, i, None]
    return rate


@overload
def evaluate(p: PolynomialMap[np.float64], x: FloatArray) -> FloatArray: ...
@overload
def evaluate(p: PolynomialMap[np.float64], x: ComplexArray) -> ComplexArray: ...
@overload
def evaluate(p: PolynomialMap[np.complex128], x: FloatArray | ComplexArray) -> ComplexArray: ...
def evaluate(p: Any, x: Any) -> Any:
    """Return p(x) = C x^E at every row of x.

    Parameters
    ----------
    x : (n_time, n_var) real or complex.

    Returns
    -------
    (n_time, n_out)
    """
    return monomials(x, p.exponents) @ p.coefficients.T


@overload
def jacobian(p: PolynomialMap[np.float64], x: FloatArray) -> FloatArray: ...
@overload
def jacobian(p: PolynomialMap[np.float64], x: ComplexArray) -> ComplexArray: ...
@overload
def jacobian(p: PolynomialMap[np.complex128], x: FloatArray | ComplexArray) -> ComplexArray: ...
def jacobian(p: Any, x: Any) -> Any:
    """Return dp/dx at every row of x; for zeta variables z and conj z count as independent.

    Parameters
    ----------
    x : (n_time, n_var) real or complex.

    Returns
    -------
    (n_time, n_out, n_var)
    """
    columns = [monomial_gradient(x, p.exponents, i) @ p.coefficients.T for i in range(x.shape[1])]
    return np.stack(columns, axis=-1)


def zeta(z: ComplexArray) -> ComplexArray:
    """Return (z_1..z_m, conj z_1..conj z_m), (n_time, 2m), from z (n_time, m)."""
    return np.concatenate([z, z.conj()], axis=-1)
