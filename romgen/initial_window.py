"""The initial state of a motion from its first periods only."""

from __future__ import annotations

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import ReducedTrajectory
from romgen.errors import NumericalError
from romgen.etdrk4 import largest_step
from romgen.polynomial import evaluate, jacobian, zeta
from romgen.reduced_model import ReducedModel
from romgen.simulate import chart_inverse
from romgen.variational import sensitivities

# The window is this many periods of the slowest mode: beats of two modes need more than one.
WINDOW_PERIODS = 3.0
STEPS = 10


def fitted_start(model: ReducedModel, r: ReducedTrajectory) -> ComplexArray:
    """Return z at r.t[0] that fits y / s over the first three periods of the slowest mode by Gauss-Newton.

    Minimises sum_k abs(y_k / s - Re(T zeta(t_k)^E))^2; the start is the inverse chart of the first sample, which is
    also the answer where the fit does not lower the misfit.

    Raises
    ------
    NumericalError : the model diverges within the window.
    """
    runs = [_gauss_newton(model, r, z0) for z0 in _candidates(model, r.y[0] / model.scale)]
    best, smallest = min(runs, key=lambda run: run[1])
    if not np.isfinite(smallest):
        raise NumericalError("the model diverges in its first periods", where=f"{model.name}, trajectory '{r.name}'")
    return best


def _candidates(model: ReducedModel, w0: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the inverse chart at w0 = y / s, and the inverse of its linear part, which never leaves its range."""
    m = len(model.eigenvalues)
    V = np.zeros((2 * m, 2 * m), dtype=np.complex128)
    linear = np.flatnonzero(model.chart.exponents.sum(axis=1) == 1)
    for k in linear:
        V[:, int(np.argmax(model.chart.exponents[k]))] = model.chart.coefficients[:, k]
    real = np.hstack([(V[:, :m] + V[:, m:]).real, -(V[:, :m] - V[:, m:]).imag])
    parts = np.linalg.solve(real, w0)
    return chart_inverse(model, w0 * model.scale)[0], parts[:m] + 1j * parts[m:]


def _gauss_newton(model: ReducedModel, r: ReducedTrajectory, z0: ComplexArray) -> tuple[ComplexArray, float]:
    """Return the best start found from z0 and its misfit over the window; inf where the model diverges."""
    window = r.t <= r.t[0] + WINDOW_PERIODS * 2.0 * np.pi / float(model.eigenvalues.imag.min())
    w = r.y[window] / model.scale
    best, smallest = z0, np.inf
    m = len(z0)
    nf = (model.normal_form.exponents, model.normal_form.coefficients)
    none = np.zeros(0, dtype=np.int64)
    for _ in range(STEPS):
        z, S = sensitivities(r.t[window], z0, model.eigenvalues, nf, (none, none), largest_step(model.eigenvalues))
        if not np.isfinite(z).all():
            break
        misfit = w - evaluate(model.chart, zeta(z)).real
        size = float(np.sum(misfit**2))
        if not size < smallest * (1.0 - 1e-9):
            break
        best, smallest = z0, size
        slope = jacobian(model.chart, zeta(z))
        D = (slope[:, :, :m] @ S + slope[:, :, m:] @ S.conj()).real
        change = np.linalg.lstsq(D.reshape(-1, 2 * m), misfit.ravel(), rcond=None)[0]
        z0 = z0 + change[:m] + 1j * change[m:]
    return best, smallest
