"""Derivatives of sampled signals by central differences of order 8, ends dropped."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline

from romgen.arrays import FloatArray
from romgen.errors import InputError

# Weights of f(x + k h) - f(x - k h) and of f(x + k h) + f(x - k h) - 2 f(x), k = 1..4 (Fornberg 1988, table 1).
FIRST = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
SECOND = (8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0)
DROPPED = 4
# Steps that differ by less are rounding of the time stamps, not irregular sampling.
STEP_TOLERANCE = 1e-4
SPLINE_DEGREE = 7


def first_derivative(x: FloatArray, step: float) -> FloatArray:
    """Return x' of the inner samples, (n_time - 8, n), from x (n_time, n) with a uniform step in s."""
    return _stencil(x, FIRST, -1.0) / step


def second_derivative(x: FloatArray, step: float) -> FloatArray:
    """Return x'' of the inner samples, (n_time - 8, n), from x (n_time, n) with a uniform step in s."""
    inner = x[DROPPED : len(x) - DROPPED]
    return (_stencil(x, SECOND, 1.0) - 2.0 * sum(SECOND) * inner) / step**2


def _stencil(x: FloatArray, weights: tuple[float, ...], sign: float) -> FloatArray:
    n = len(x)
    if n <= 2 * DROPPED:
        raise InputError("too short for derivatives", where="differences", value=n, advice="give at least 9 samples")
    total = np.zeros_like(x[2 * DROPPED :])
    for k, weight in enumerate(weights, start=1):
        later, earlier = x[DROPPED + k : n - DROPPED + k], x[DROPPED - k : n - DROPPED - k]
        total += weight * (later + sign * earlier)
    return total


def is_uniform(t: FloatArray, step: float | None = None) -> bool:
    """Whether all steps of t agree with ``step`` (default: their mean)."""
    steps = np.diff(t)
    expected = float(steps.mean()) if step is None else step
    return bool(np.abs(steps - expected).max() <= STEP_TOLERANCE * expected)


def resample(t: FloatArray, x: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return uniform times from t[0] in steps of ``step`` and x there, by an interpolating spline of degree 7.

    Raises
    ------
    InputError : fewer samples than such a spline needs.
    """
    if len(t) <= SPLINE_DEGREE:
        advice = f"give at least {SPLINE_DEGREE + 1} samples"
        raise InputError("too short for resampling", where="differences", value=len(t), advice=advice)
    n = int(np.floor((t[-1] - t[0]) / step * (1 + 1e-12))) + 1
    uniform = t[0] + step * np.arange(n)
    values: FloatArray = make_interp_spline(t, x, k=SPLINE_DEGREE, axis=0)(np.minimum(uniform, t[-1]))
    return uniform, values
