"""The order of the normal form by cross-validation over blocks of the training trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.errors import NumericalError
from romgen.initial_window import fitted_start
from romgen.metrics import nmte_percent
from romgen.normal_form import NormalFormFit, fit_normal_form
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.settings import LearnSettings
from romgen.simulate import coordinates, simulate

CANDIDATES = (3, 5, 7)
# Alternate blocks train and test, so both folds see all amplitudes.
BLOCKS, FOLDS = 8, 2
# A higher order must be this much better: below it is noise of the blocks.
IMPROVEMENT = 0.9


@dataclass(frozen=True)
class OrderTable:
    """Cross-validated error of each order tried.

    Attributes
    ----------
    order : the lowest order that the next one does not improve by a tenth.
    tried : (n_tried,) orders.
    nmte_percent : (n_tried,) mean NMTE of reduced coordinates on held-out blocks; inf where a fit or run failed.
    """

    order: int
    tried: IntArray = field(metadata={"unit": "1", "axes": "order"})
    nmte_percent: FloatArray = field(metadata={"unit": "%", "axes": "order"})


def choose_order(training: Sequence[ReducedTrajectory], settings: LearnSettings) -> OrderTable:
    """Return the order by two-fold cross-validation over alternating blocks of time, training data only.

    Raises
    ------
    NumericalError : no order gives a model that survives its held-out blocks.
    """
    tried: list[int] = []
    errors: list[float] = []
    best = -1
    for order in CANDIDATES:
        tried.append(order)
        errors.append(cross_validation_error(training, order, settings))
        if best >= 0 and not errors[-1] < IMPROVEMENT * errors[best]:
            break
        if np.isfinite(errors[-1]):
            best = len(errors) - 1
    if best < 0:
        raise NumericalError(
            "no order gives a stable model", where="learn order", value=tried, advice="give longer or cleaner decays"
        )
    return OrderTable(tried[best], np.array(tried), np.array(errors))


def cross_validation_error(training: Sequence[ReducedTrajectory], order: int, settings: LearnSettings) -> float:
    """Return the mean NMTE in percent over held-out blocks; inf where a fit or a run fails."""
    errors = []
    for fold in range(FOLDS):
        held_out = [block for r in training for block in _blocks(r)[fold::FOLDS]]
        rest = [block for r in training for k, block in enumerate(_blocks(r)) if k % FOLDS != fold]
        try:
            fit = fit_normal_form(rest, order, settings.internal_resonance, settings.ridge)
            errors += [block_error(fit, block) for block in held_out]
        except NumericalError:
            return float("inf")
    return float(np.mean(errors))


def simulation_error(fit: NormalFormFit, motions: Sequence[ReducedTrajectory]) -> float:
    """Return the mean NMTE in percent of y / s over motions; inf where one diverges."""
    try:
        return float(np.mean([block_error(fit, motion) for motion in motions]))
    except NumericalError:
        return float("inf")


def block_error(fit: NormalFormFit, block: ReducedTrajectory) -> float:
    """Return the NMTE in percent of y / s over a block, simulated from its first period."""
    model = autonomous_model(fit)
    z = simulate(model, block.t, fitted_start(model, block))
    return nmte_percent(block.y / model.scale, coordinates(model, z) / model.scale)


def autonomous_model(fit: NormalFormFit) -> ReducedModel:
    """Return the model of a normal form alone: reduced coordinates, no sensors, no inputs."""
    dynamics = fit.dynamics
    m = len(dynamics.eigenvalues)
    nothing = PolynomialMap(np.eye(2 * m, dtype=np.int64), np.zeros((0, 2 * m)))
    return ReducedModel(
        name="candidate",
        eigenvalues=dynamics.eigenvalues,
        normal_form=fit.normal_form,
        chart=fit.chart,
        inverse_chart=fit.inverse_chart,
        scale=dynamics.scale,
        displacement=nothing,
        velocity=nothing,
        sensors=(),
        inputs=(),
        input_units=(),
        input_matrix=np.zeros((m, 0), dtype=np.complex128),
        internal_resonance=fit.resonance.internal_resonance,
        trained_amplitude=np.full(m, 0.5),
    )


def _blocks(r: ReducedTrajectory) -> list[ReducedTrajectory]:
    return [
        ReducedTrajectory(r.name, r.t[k], r.y[k], r.y_dot[k], r.displacement[k], r.velocity[k])
        for k in np.array_split(np.arange(len(r.t)), BLOCKS)
    ]
