"""Example records, and equality of records that hold arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel


def same(a: Any, b: Any) -> bool:
    """Whether two records are equal in type, values, shapes and dtypes; nan equals nan."""
    if is_dataclass(a):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
    if isinstance(a, Mapping):
        return isinstance(b, Mapping) and a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return type(a) is type(b) and bool(a == b or (a != a and b != b))


def example_model() -> ReducedModel:
    """A linear two-mode model with one sensor, 110 and 196 Hz, base acceleration as input."""
    identity, complex_rows = np.eye(4, dtype=np.int64), np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], dtype=complex)
    return ReducedModel(
        name="example",
        eigenvalues=np.array([-3.2 + 694.1j, -6.5 + 1232.2j]),
        normal_form=PolynomialMap(np.array([[0, 1, 1, 0], [2, 0, 0, 0]]), np.array([[1j, 0.0], [0.0, 2j]])),
        chart=PolynomialMap(identity, np.vstack([complex_rows, 1j * complex_rows])),
        inverse_chart=PolynomialMap(identity, 0.5 * complex_rows),
        scale=np.array([1e-3, 1e-3, 1.0, 1.0]),
        displacement=PolynomialMap(identity, np.array([[1e-3, 1e-3, 0.0, 0.0]])),
        velocity=PolynomialMap(identity, np.array([[0.0, 0.0, 1e-3, 1e-3]])),
        sensors=("mid",),
        inputs=("base_acceleration",),
        input_units=("m/s2",),
        input_matrix=np.array([[0.1 - 0.2j], [0.0j]]),
        internal_resonance=(1, 2),
        trained_amplitude=np.array([1.0, 0.5]),
    )
