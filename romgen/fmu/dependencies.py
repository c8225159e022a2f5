"""Which states a rate or a sensor depends on, read off the nonzero coefficients."""

from __future__ import annotations

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.reduced_model import ReducedModel


def state_couplings(model: ReducedModel) -> BoolArray:
    """(m, m) true where z_i' depends on z_j or conj z_j."""
    m = len(model.eigenvalues)
    used = _used_variables(model.normal_form.exponents, model.normal_form.coefficients)
    coupled: BoolArray = used[:, :m] | used[:, m:] | np.eye(m, dtype=bool)
    return coupled


def sensor_states(model: ReducedModel) -> tuple[BoolArray, BoolArray]:
    """(n_sensor, m) true where a displacement, and where a velocity, depends on z_j or conj z_j."""
    m = len(model.eigenvalues)
    chart = _used_variables(model.chart.exponents, model.chart.coefficients)
    coordinates = chart[:, :m] | chart[:, m:]
    x = _used_variables(model.displacement.exponents, model.displacement.coefficients)
    v = _used_variables(model.velocity.exponents, model.velocity.coefficients)
    return (x.astype(int) @ coordinates.astype(int)) > 0, (v.astype(int) @ coordinates.astype(int)) > 0


def _used_variables(exponents: IntArray, coefficients: FloatArray | ComplexArray) -> BoolArray:
    """(n_out, n_var) true where an output has a nonzero term in a variable."""
    used: BoolArray = ((coefficients != 0).astype(int) @ (exponents > 0).astype(int)) > 0
    return used
