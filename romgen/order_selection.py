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
from romgen.reduced_dynamics import modal_samples
from romgen.reduced_model import ReducedModel
from romgen.settings import LearnSettings
from romgen.simulate import coordinates, simulate

CANDIDATES = (3, 5, 7)
# Alternate blocks train and test; eight per trajectory leave several beats of two modes in each.
BLOCKS, FOLDS = 8, 2
# A higher order must be this much better: below it is noise of the blocks.
IMPROVEMENT = 0.9
# A block that diverges, or misses by more, counts with this NMTE in percent: the motion was not predicted at all.
LOST_PERCENT = 100.0


@dataclass(frozen=True)
class OrderTable:
    """Cross-validated error of each order tried.

    Held-out blocks whose modal amplitudes exceed those of the blocks fitted are not scored: a polynomial promises
    nothing there. So the first block of a decay, its largest amplitudes, usually only trains.

    Attributes
    ----------
    order : the lowest order that the next one does not improve by a tenth.
    tried : (n_tried,) orders.
    nmte_percent : (n_tried,) mean NMTE of reduced coordinates on held-out blocks within the amplitudes of the fit;
        a block that diverges counts 100 %; inf where a fit failed.
    scored, lost : (n_tried,) number of blocks in the mean, and how many of them counted 100 %.
    """

    order: int
    tried: IntArray = field(metadata={"unit": "1", "axes": "order"})
    nmte_percent: FloatArray = field(metadata={"unit": "%", "axes": "order"})
    scored: IntArray = field(metadata={"unit": "1", "axes": "order"})
    lost: IntArray = field(metadata={"unit": "1", "axes": "order"})


def choose_order(training: Sequence[ReducedTrajectory], settings: LearnSettings) -> OrderTable:
    """Return the order by two-fold cross-validation over alternating blocks of time, training data only.

    Raises
    ------
    NumericalError : no order can be fitted, or all lose every block.
    """
    tried: list[int] = []
    errors: list[FloatArray] = []
    means: list[float] = []
    best = -1
    for order in CANDIDATES:
        tried.append(order)
        errors.append(held_out_errors(training, order, settings))
        means.append(float(errors[-1].mean()) if errors[-1].size else float("inf"))
        if best >= 0 and not means[-1] < IMPROVEMENT * means[best]:
            break
        if means[-1] < LOST_PERCENT:
            best = len(tried) - 1
    if best < 0:
        raise NumericalError(
            "no order gives a stable model", where="learn order", value=tried, advice="give longer or cleaner decays"
        )
    scored = np.array([e.size for e in errors])
    lost = np.array([int((e >= LOST_PERCENT).sum()) for e in errors])
    return OrderTable(tried[best], np.array(tried), np.array(means), scored, lost)


def held_out_errors(training: Sequence[ReducedTrajectory], order: int, settings: LearnSettings) -> FloatArray:
    """Return the NMTE in percent, at most 100, of each held-out block in range; none where a fit fails."""
    errors: list[float] = []
    for fold in range(FOLDS):
        held_out = [block for r in training for block in _blocks(r)[fold::FOLDS]]
        rest = [block for r in training for k, block in enumerate(_blocks(r)) if k % FOLDS != fold]
        try:
            fit = fit_normal_form(rest, order, settings.internal_resonance, settings.ridge)
        except NumericalError:
            return np.zeros(0)
        largest = np.max([modal_amplitudes(fit, block) for block in rest], axis=0)
        inside = [block for block in held_out if np.all(modal_amplitudes(fit, block) <= largest)]
        errors += [min(motion_error(fit, block), LOST_PERCENT) for block in inside]
    return np.array(errors)


def modal_amplitudes(fit: NormalFormFit, r: ReducedTrajectory) -> FloatArray:
    """Return the largest abs(q_j) of a motion, (m,), q the modal coordinates of the linear part."""
    largest: FloatArray = np.abs(modal_samples(fit.dynamics, r)[0]).max(axis=0)
    return largest


def simulation_error(fit: NormalFormFit, motions: Sequence[ReducedTrajectory]) -> float:
    """Return the mean NMTE in percent of y / s over motions; inf where one diverges."""
    return float(np.mean([motion_error(fit, motion) for motion in motions]))


def motion_error(fit: NormalFormFit, r: ReducedTrajectory) -> float:
    """Return the NMTE in percent of y / s over a motion, simulated from its first periods; inf where it diverges."""
    model = autonomous_model(fit)
    try:
        z = simulate(model, r.t, fitted_start(model, r))
    except NumericalError:
        return float("inf")
    return nmte_percent(r.y / model.scale, coordinates(model, z) / model.scale)


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
