"""Multivariate polynomials as exponent tables and coefficient matrices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from romgen.arrays import IntArray

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
