"""pySINDy as a peer: sparse polynomial regression of the reduced dynamics, without manifold theory."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.chart import ReducedTrajectory
from romgen.metrics import nmte_percent

NO_PYSINDY = (
    ""
    if importlib.util.find_spec("pysindy")
    else "pySINDy is not installed: its rows are left out (pip install pysindy)"
)
ORDER = 3
# A motion this many times larger than the training data has diverged.
FAR = 10.0


def sparse_regression(
    training: Sequence[ReducedTrajectory], held_out: Sequence[ReducedTrajectory], threshold: float
) -> tuple[float, list[float]]:
    """Return the time of the fit in s and the NMTE in percent of each held-out motion; inf where it diverges.

    Coordinates are divided by their largest value, derivatives given (the ends of the motions are dropped); motions
    start from their first sample, errors are those of the sensors, which are linear in the coordinates to first order.
    """
    import pysindy

    scale = np.abs(np.vstack([r.y for r in training])).max(axis=0)
    library = pysindy.PolynomialLibrary(degree=ORDER, include_bias=False)
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=threshold, alpha=0.0), feature_library=library)
    states = [r.y / scale for r in training]
    rates = [r.y_dot / scale for r in training]
    start = time.perf_counter()
    model.fit(states, t=float(training[0].t[1] - training[0].t[0]), x_dot=rates)
    wall_s = time.perf_counter() - start
    to_sensors = np.linalg.lstsq(np.vstack(states), np.vstack([r.displacement for r in training]), rcond=None)[0]
    coefficients = np.asarray(model.coefficients())
    powers = np.asarray(model.feature_library.powers_)
    return wall_s, [_error(coefficients, powers, r, scale, to_sensors) for r in held_out]


def _error(
    coefficients: FloatArray, powers: FloatArray, r: ReducedTrajectory, scale: FloatArray, to_sensors: FloatArray
) -> float:
    def rate(_: float, y: FloatArray) -> FloatArray:
        return np.asarray(coefficients @ np.prod(y**powers, axis=1))

    def far(_: float, y: FloatArray) -> float:
        return FAR - float(np.abs(y).max())

    far.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(rate, (r.t[0], r.t[-1]), r.y[0] / scale, "DOP853", r.t, rtol=1e-6, atol=1e-9, events=far)
    if found.y.shape[1] < len(r.t):
        return float("inf")
    return nmte_percent(r.displacement, found.y.T @ to_sensors)
