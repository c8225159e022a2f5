"""Typical size of each sensor output, for the nominal values of the interface."""

from __future__ import annotations

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.polynomial import PolynomialMap, evaluate, zeta
from romgen.reduced_model import ReducedModel

N_PHASE = 32


def nominal_displacement(model: ReducedModel) -> FloatArray:
    """(n_sensor,) m, largest displacement while each mode in turn goes round at its trained amplitude."""
    return _largest(model, model.displacement)


def nominal_velocity(model: ReducedModel) -> FloatArray:
    """(n_sensor,) m/s, the same for the velocity."""
    return _largest(model, model.velocity)


def _largest(model: ReducedModel, sensors: PolynomialMap[np.float64]) -> FloatArray:
    z = _trained_circles(model)
    y = evaluate(model.chart, zeta(z)).real
    largest: FloatArray = np.max(np.abs(evaluate(sensors, y)), axis=0)
    return largest


def _trained_circles(model: ReducedModel) -> ComplexArray:
    """(n_mode N_PHASE, n_mode) states with one mode at its trained amplitude."""
    m = len(model.eigenvalues)
    phases = np.exp(2j * np.pi * np.arange(N_PHASE) / N_PHASE)
    z: ComplexArray = np.zeros((m * N_PHASE, m), dtype=np.complex128)
    for j in range(m):
        z[j * N_PHASE : (j + 1) * N_PHASE, j] = model.trained_amplitude[j] * phases
    return z
