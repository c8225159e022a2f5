"""The normal-form state of given reduced coordinates: w = y / s = Re(T zeta(z)^E) solved for z.

Newton from z = H w^E, where the data were, converges quadratically. Where it does not, w lies beside what the chart
reaches (noise of velocities, fast modes, amplitudes beyond the data), and its nearest point is found instead.
"""

from __future__ import annotations

import logging

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.polynomial import evaluate, jacobian, zeta
from romgen.reduced_model import ReducedModel

log = logging.getLogger(__name__)
# Newton stops at rounding; from H it converges quadratically or not at all.
NEWTON_TOLERANCE = 1e-13
NEWTON_STEPS = 20
# Levenberg-Marquardt: steps, first damping, and the relative decrease of the misfit at which it ends.
NEAREST_STEPS, DAMPING, DECREASE = 50, 1e-3, 1e-6


def initial_state(model: ReducedModel, y0: FloatArray) -> ComplexArray:
    """Return z (m,) with Re(T zeta^E) = y0 / s, or the nearest the chart can reach, which is logged as a warning.

    Parameters
    ----------
    y0 : (2m,) modal displacements and velocities.
    """
    z, misfit = chart_inverse(model, y0)
    if misfit > NEWTON_TOLERANCE:
        log.warning(
            "%s: start state misses y by %.2g of its size; it lies outside the charted range", model.name, misfit
        )
    return z


def chart_inverse(model: ReducedModel, y0: FloatArray) -> tuple[ComplexArray, float]:
    """Return z (m,) for y0 (2m,) and what it misses, max abs(Re(T zeta^E) - y0/s) / max(1, abs(y0/s))."""
    w0 = y0 / model.scale
    charted: ComplexArray = evaluate(model.inverse_chart, w0[None])[0]
    root = _newton(model, w0, charted)
    if root is not None:
        return root, _relative(_miss(model, w0, root), w0)
    found = [_nearest(model, w0, start) for start in (charted, linear_start(model, y0))]
    z = min(found, key=lambda z: float(np.sum(_miss(model, w0, z) ** 2)))
    return z, _relative(_miss(model, w0, z), w0)


def linear_start(model: ReducedModel, y0: FloatArray) -> ComplexArray:
    """Return z (m,) of y0 (2m,) by the inverse of the linear part of the chart, which never leaves its range."""
    m = len(model.eigenvalues)
    V = np.zeros((2 * m, 2 * m), dtype=np.complex128)
    linear = np.flatnonzero(model.chart.exponents.sum(axis=1) == 1)
    for k in linear:
        V[:, int(np.argmax(model.chart.exponents[k]))] = model.chart.coefficients[:, k]
    parts = np.linalg.solve(_real_slopes(V), y0 / model.scale)
    z0: ComplexArray = parts[:m] + 1j * parts[m:]
    return z0


def _newton(model: ReducedModel, w0: FloatArray, start: ComplexArray) -> ComplexArray | None:
    """Return the root near the start; None where there is none.

    T is trusted on the data cloud only: a root far from H w^E belongs to another branch.
    """
    z, m = start, len(start)
    for _ in range(NEWTON_STEPS):
        miss = _miss(model, w0, z)
        if _relative(miss, w0) <= NEWTON_TOLERANCE:
            return z
        try:
            change = np.linalg.solve(_slopes(model, z), miss)
        except np.linalg.LinAlgError:
            return None
        z = z - (change[:m] + 1j * change[m:])
        if not np.abs(z - start).max() <= 0.5 * max(float(np.abs(start).max()), 1e-12):
            return None
    return None


def _nearest(model: ReducedModel, w0: FloatArray, start: ComplexArray) -> ComplexArray:
    """Return a minimum of abs(Re(T zeta^E) - w0)^2 by Levenberg-Marquardt."""
    z, miss, damping, m = start, _miss(model, w0, start), DAMPING, len(start)
    for _ in range(NEAREST_STEPS):
        J, size = _slopes(model, z), float(miss @ miss)
        H = J.T @ J
        change = np.linalg.solve(H + damping * np.diag(np.maximum(np.diag(H), np.finfo(float).tiny)), J.T @ miss)
        trial = z - (change[:m] + 1j * change[m:])
        trial_miss = _miss(model, w0, trial)
        better = float(trial_miss @ trial_miss)
        if not better < size:
            damping *= 8.0
            continue
        z, miss, damping = trial, trial_miss, damping / 8.0
        if better > (1.0 - DECREASE) * size:
            break
    return z


def _miss(model: ReducedModel, w0: FloatArray, z: ComplexArray) -> FloatArray:
    w: FloatArray = evaluate(model.chart, zeta(z[None]))[0].real - w0
    return w


def _relative(miss: FloatArray, w0: FloatArray) -> float:
    return float(np.abs(miss).max()) / max(1.0, float(np.abs(w0).max()))


def _slopes(model: ReducedModel, z: ComplexArray) -> FloatArray:
    """Return dw/d(Re z, Im z), (2m, 2m)."""
    return _real_slopes(jacobian(model.chart, zeta(z[None]))[0])


def _real_slopes(J: ComplexArray) -> FloatArray:
    """Return slopes by (Re z, Im z) of the real part of a map with slopes J (2m, 2m) by (z, conj z)."""
    m = J.shape[1] // 2
    slopes: FloatArray = np.hstack([(J[:, :m] + J[:, m:]).real, -(J[:, :m] - J[:, m:]).imag])
    return slopes
