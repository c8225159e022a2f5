"""The initial state of a motion from its first periods only."""

from __future__ import annotations

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray
from romgen.chart import ReducedTrajectory
from romgen.chart_inverse import chart_inverse, linear_start
from romgen.errors import NumericalError
from romgen.etdrk4 import largest_step
from romgen.field_table import real_map
from romgen.reduced_model import ReducedModel
from romgen.variational import real_slopes, sensitivities

# The window is this many periods of the slowest mode: beats of two modes need more than one.
WINDOW_PERIODS = 3.0
STEPS = 20
HALVINGS, DECREASE = 6, 1e-9


def fitted_start(model: ReducedModel, r: ReducedTrajectory) -> ComplexArray:
    """Return z at r.t[0] that fits eta over the first three periods of the slowest mode by Gauss-Newton.

    Minimises the sum of abs(eta_k - s Re(T zeta(t_k)^E))^2; eta' is left out, as it carries the fast modes that the
    first periods of a motion may still have. The starts are the inverse chart of the first sample and its linear part.

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
    y0 = w0 * model.scale
    return chart_inverse(model, y0)[0], linear_start(model, y0)


def _gauss_newton(model: ReducedModel, r: ReducedTrajectory, z0: ComplexArray) -> tuple[ComplexArray, float]:
    """Return the best start found from z0 and its misfit over the window; inf where the model diverges.

    A step that does not lower the misfit is halved: far from the answer the chart is curved.
    """
    window = r.t <= r.t[0] + WINDOW_PERIODS * 2.0 * np.pi / float(model.eigenvalues.imag.min())
    best, (misfit, D) = z0, _misfit(model, r, window, z0)
    m = len(z0)
    for _ in range(STEPS):
        if not np.isfinite(misfit).all():
            return best, np.inf
        change = np.linalg.lstsq(D, misfit, rcond=None)[0]
        size = float(misfit @ misfit)
        for halved in range(HALVINGS):
            trial = best + 0.5**halved * (change[:m] + 1j * change[m:])
            trial_misfit, trial_D = _misfit(model, r, window, trial)
            if float(trial_misfit @ trial_misfit) < size * (1.0 - DECREASE):
                break
        else:
            break
        best, misfit, D = trial, trial_misfit, trial_D
    size = float(misfit @ misfit)
    return best, size if np.isfinite(size) else np.inf


def _misfit(
    model: ReducedModel, r: ReducedTrajectory, window: BoolArray, z0: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Return data minus model of the modal displacements over the window, stacked, and the slope of the model."""
    m = len(z0)
    nf = (model.normal_form.exponents, model.normal_form.coefficients)
    none = np.zeros(0, dtype=np.int64)
    z, W = sensitivities(r.t[window], z0, model.eigenvalues, nf, (none, none), largest_step(model.eigenvalues))
    if not np.isfinite(z).all():
        return np.full(m * len(z), np.inf), np.zeros((m * len(z), 2 * m))
    eta, s = real_map(model.chart.exponents, model.chart.coefficients[:m], z)
    unit = model.scale[:m] / model.scale[:m].max()
    g = np.stack([unit[j] * real_slopes(s[:, j], W) for j in range(m)], axis=1)
    misfit = (r.y[window, :m] / model.scale[:m] - eta.real) * unit
    return misfit.ravel(), np.concatenate([g.real, -g.imag], axis=-1).reshape(-1, 2 * m)
