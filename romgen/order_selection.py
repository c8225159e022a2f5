"""Order and method of the normal form by cross-validation over blocks of the training trajectories."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from romgen.arrays import BoolArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.errors import NumericalError
from romgen.initial_window import fitted_start
from romgen.metrics import nmte_percent
from romgen.normal_form import NormalFormFit, fit_normal_form
from romgen.polynomial import PolynomialMap
from romgen.reduced_dynamics import LinearPart, modal_samples
from romgen.reduced_model import ReducedModel
from romgen.settings import LearnSettings
from romgen.simulate import coordinates, simulate
from romgen.stability import tried_stability
from romgen.trajectory_fit import check_long_enough, growing_fits, is_long_enough

CANDIDATES = (3, 5, 7)
# Alternate blocks train and test; eight per trajectory leave several beats of two modes in each.
BLOCKS, FOLDS = 8, 2
# A higher order of a conjugacy fit must be this much better: below it is noise of the blocks. The priors of fits on
# trajectories keep useless terms small, so there any improvement counts: blocks at the largest amplitudes, where high
# orders act most, are seldom scored.
IMPROVEMENT: dict[str, float] = {"conjugacy": 0.9, "trajectories": 1.0}
# A block that diverges, or misses by more, counts with this NMTE in percent: the motion was not predicted at all.
LOST_PERCENT = 100.0
# The error of a fit whose free motions in the trained range do not all decay counts this many times.
UNSTABLE = 2.0
# Conjugacy fits that predict held-out blocks within this NMTE in percent need no (far slower) fit on trajectories: a
# tenth of the error aimed at. Noise alone puts more than this into every block, so noisy data always try both.
GOOD_PERCENT = 0.1
# A conjugacy fit must be this much better than one on trajectories: noise of the derivatives biases its rates, which
# blocks of few periods hardly show and whole motions do.
PREFERRED = 0.9

Method = Literal["conjugacy", "trajectories"]


@dataclass(frozen=True)
class OrderTable:
    """Cross-validated error of each order and method tried.

    Held-out blocks whose modal amplitudes exceed those of the blocks fitted are not scored: a polynomial promises
    nothing there. So the first block of a decay, its largest amplitudes, usually only trains.

    Attributes
    ----------
    order : of the best; a higher order of a conjugacy fit counts only where it is better by a tenth.
    method : of the best: "conjugacy", the instantaneous rates, or "trajectories", whole motions.
    tried : (n_tried,) orders; methods : the method of each.
    nmte_percent : (n_tried,) mean NMTE of the modal displacements on held-out blocks within the amplitudes of the fit,
        relative to the largest norm of their whole trajectory; a block that diverges counts 100 %; inf where a fit
        failed.
    scored, lost : (n_tried,) number of blocks in the mean, and how many of them counted 100 %.
    stable : (n_tried,) whether all free motions from the boundary of the trained range decay in both folds; an order
        for which they do not is taken only where its error is less than half that of the others.
    """

    order: int
    method: Method
    tried: IntArray = field(metadata={"unit": "1", "axes": "order"})
    methods: tuple[str, ...]
    nmte_percent: FloatArray = field(metadata={"unit": "%", "axes": "order"})
    scored: IntArray = field(metadata={"unit": "1", "axes": "order"})
    lost: IntArray = field(metadata={"unit": "1", "axes": "order"})
    stable: BoolArray = field(metadata={"unit": "1", "axes": "order"})


@dataclass(frozen=True)
class _Trial:
    order: int
    method: Method
    errors: FloatArray
    stable: bool

    @property
    def mean(self) -> float:
        """Mean over blocks in percent."""
        return float(self.errors.mean()) if self.errors.size else float("inf")

    @property
    def score(self) -> float:
        """What decides: the mean, larger where the fits are not stable."""
        return self.mean if self.stable else UNSTABLE * self.mean


def choose_order(
    training: Sequence[ReducedTrajectory], settings: LearnSettings, known: LinearPart | None = None
) -> OrderTable:
    """Return order and method by two-fold cross-validation over alternating blocks of time, training data only.

    A given order leaves the method to choose, a given method the order. Left to choose, fits on trajectories are tried
    where the conjugacy fit misses held-out blocks by more than GOOD_PERCENT and the data are uniform and long enough.

    Raises
    ------
    InputError : fits on trajectories are asked for, and the data are not uniform or too short.
    NumericalError : no order can be fitted, or all lose every block.
    """
    orders, given = CANDIDATES if settings.order == "auto" else (int(settings.order),), (settings, known)
    if settings.method == "refined":
        check_long_enough(training)
        trials, best = _improving(_trajectory_trials(training, orders, given))
    else:
        trials, best = _improving(_conjugacy_trials(training, orders, given))
    if settings.method == "auto" and best.score > GOOD_PERCENT and is_long_enough(training):
        more, other = _improving(_trajectory_trials(training, orders, given))
        trials += more
        best = best if best.score < PREFERRED * other.score else other
    if not best.mean < LOST_PERCENT:
        raise NumericalError(
            "no order gives a stable model", where="learn order", value=orders, advice="give longer or cleaner decays"
        )
    return OrderTable(
        order=best.order,
        method=best.method,
        tried=np.array([trial.order for trial in trials]),
        methods=tuple(trial.method for trial in trials),
        nmte_percent=np.array([trial.mean for trial in trials]),
        scored=np.array([trial.errors.size for trial in trials]),
        lost=np.array([int((trial.errors >= LOST_PERCENT).sum()) for trial in trials]),
        stable=np.array([trial.stable for trial in trials]),
    )


def _improving(trials: Iterator[_Trial]) -> tuple[list[_Trial], _Trial]:
    """Return the trials up to the first that does not improve enough, and the best of them."""
    tried = [next(trials)]
    best = tried[0]
    for trial in trials:
        tried.append(trial)
        if not trial.score < IMPROVEMENT[trial.method] * best.score and np.isfinite(best.score):
            break
        best = trial
    return tried, best


def _conjugacy_trials(
    training: Sequence[ReducedTrajectory], orders: Sequence[int], given: tuple[LearnSettings, LinearPart | None]
) -> Iterator[_Trial]:
    settings, known = given
    for order in orders:
        errors: list[float] = []
        stable = True
        for kept in _folds(training):
            seen = [block for r, keep in zip(training, kept, strict=True) for block in _runs(r, keep)]
            try:
                fit = fit_normal_form(seen, order, settings.internal_resonance, settings.ridge, known)
            except NumericalError:
                errors, stable = [], False
                break
            errors += _held_out_errors(fit, training, kept)
            stable = stable and is_stable(fit)
        yield _Trial(order, "conjugacy", np.array(errors), stable)


def _trajectory_trials(
    training: Sequence[ReducedTrajectory], orders: Sequence[int], given: tuple[LearnSettings, LinearPart | None]
) -> Iterator[_Trial]:
    settings, known = given
    folds = _folds(training)
    options = (settings.internal_resonance, settings.ridge, known)
    fits = [growing_fits(training, kept, orders, options) for kept in folds]
    for order in orders:
        try:
            with ThreadPoolExecutor(FOLDS) as threads:
                grown = list(threads.map(next, fits))
        except NumericalError:
            yield _Trial(order, "trajectories", np.zeros(0), False)
            return
        errors = [
            error for fit, kept in zip(grown, folds, strict=True) for error in _held_out_errors(fit, training, kept)
        ]
        yield _Trial(order, "trajectories", np.array(errors), all(is_stable(fit) for fit in grown))


def is_stable(fit: NormalFormFit) -> bool:
    """Whether free motions from the boundary of the trained range all decay."""
    return tried_stability(fit.dynamics.eigenvalues, fit.normal_form, fit.trained_range, (1.0,)).is_stable


def _held_out_errors(
    fit: NormalFormFit, training: Sequence[ReducedTrajectory], kept: Sequence[BoolArray]
) -> list[float]:
    """Return the NMTE in percent, at most 100, of each held-out block within the amplitudes of the kept samples."""
    pairs, unit = list(zip(training, kept, strict=True)), _displacement_unit(fit)
    largest = np.max([modal_amplitudes(fit, r.masked(keep)) for r, keep in pairs], axis=0)
    errors = []
    for r, keep in pairs:
        norms = np.linalg.norm(r.y[:, : len(unit)] / unit, axis=1)
        for block in _runs(r, ~keep):
            if np.all(modal_amplitudes(fit, block) <= largest):
                own = np.linalg.norm(block.y[:, : len(unit)] / unit, axis=1).max()
                errors.append(min(motion_error(fit, block) * own / norms.max(), LOST_PERCENT))
    return errors


def _folds(training: Sequence[ReducedTrajectory]) -> list[list[BoolArray]]:
    """Return per fold and trajectory the samples that train, (n_time,)."""
    blocks = [np.arange(len(r.t)) * BLOCKS // len(r.t) for r in training]
    return [[block % FOLDS != fold for block in blocks] for fold in range(FOLDS)]


def _runs(r: ReducedTrajectory, keep: BoolArray) -> list[ReducedTrajectory]:
    """Return the blocks of a trajectory where ``keep`` is True."""
    block = np.arange(len(r.t)) * BLOCKS // len(r.t)
    return [r.masked(block == k) for k in range(BLOCKS) if keep[np.argmax(block == k)]]


def modal_amplitudes(fit: NormalFormFit, r: ReducedTrajectory) -> FloatArray:
    """Return the largest abs(q_j) of a motion, (m,), q the modal coordinates of the linear part."""
    largest: FloatArray = np.abs(modal_samples(fit.dynamics, r)[0]).max(axis=0)
    return largest


def motion_error(fit: NormalFormFit, r: ReducedTrajectory) -> float:
    """Return the NMTE in percent of eta / s over a motion, simulated from its first periods; inf where it diverges.

    Velocities are left out, as in the fit of the start: in recorded motions they carry the noise of differences.
    """
    model, unit = autonomous_model(fit), _displacement_unit(fit)
    try:
        z = simulate(model, r.t, fitted_start(model, r))
    except NumericalError:
        return float("inf")
    m = len(unit)
    return nmte_percent(r.y[:, :m] / unit, coordinates(model, z)[:, :m] / unit)


def _displacement_unit(fit: NormalFormFit) -> FloatArray:
    return fit.dynamics.scale[: len(fit.dynamics.eigenvalues)]


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
