"""A normal form fitted on whole trajectories: better of two starts, multiple shooting, growing order, refinement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from romgen.arrays import BoolArray, ComplexArray
from romgen.chart import ReducedTrajectory
from romgen.differences import is_uniform
from romgen.dissipative_fit import dissipative
from romgen.errors import InputError, NumericalError
from romgen.jackknife import Replicates
from romgen.linear_reference import LinearReference, linear_reference
from romgen.normal_form import FitOrigin, NormalFormFit, Resonance, fit_normal_form, resonance_table
from romgen.reduced_dynamics import LinearPart
from romgen.refined_chart import refined_normal_form
from romgen.refined_dynamics import RefinedDynamics, Segment
from romgen.refinement import refine, regrown, replicates
from romgen.resonance import ResonanceTable
from romgen.shooting_start import Start, band_passed, charted, segments, start_model

START_ORDER = 3
MIN_PERIODS = 20.0
# Coordinates above this share of the largest count for the periods of a motion.
STRONG = 0.1
# Segments per motion up to SHOT_ORDER: short enough that the rates of the start lose no period within one. Two blocks
# of the cross-validation make one, so every segment has samples that count.
SHOTS, SHOT_ORDER = 4, 5
SHOT_STEPS, SHOT_DECREASE = 12, 1e-3
# Cost of the shooting from the direct fit, relative to that from band-passed signals, below which it is taken.
IMPROVED = 0.9
STEPS, DECREASE = 30, 1e-4
# Internal steps: at least so many per period of the fastest mode, and the largest turn of a detuned term within one in
# radians, which leaves 2e-5 of that term.
STEPS_PER_PERIOD, LARGEST_TURN = 4.0, 0.5


def is_long_enough(training: Sequence[ReducedTrajectory]) -> bool:
    """Whether every trajectory is uniform and has 20 periods of its slowest strong motion, as band-passing needs.

    A period is two sign changes of a modal coordinate about its mean over the last quarter: where sensors have offsets
    or friction leaves a rest position, a decay does not cross zero to its end.
    """
    return all(is_uniform(r.t) and _periods(r) >= MIN_PERIODS for r in training)


def check_long_enough(training: Sequence[ReducedTrajectory]) -> None:
    """Refuse what ``is_long_enough`` denies, naming the first trajectory that is not.

    Raises
    ------
    InputError : irregular samples, or fewer than 20 periods.
    """
    for r in training:
        uniform = is_uniform(r.t)
        if not uniform or _periods(r) < MIN_PERIODS:
            raise InputError(
                f"fits on whole motions need uniform samples and {MIN_PERIODS:g} periods of every strong mode",
                where=f"[learn] method, trajectory '{r.name}'",
                value=f"{_periods(r):.3g} periods" if uniform else "irregular samples",
                advice='give longer decays or a smaller start_time, or set method = "direct"',
            )


def _periods(r: ReducedTrajectory) -> float:
    eta = r.y[:, : r.y.shape[1] // 2]
    eta = eta - eta[3 * len(eta) // 4 :].mean(axis=0)
    largest = np.abs(eta).max(axis=0)
    crossings = np.count_nonzero(np.diff(np.signbit(eta), axis=0), axis=0)
    return 0.5 * float(crossings[largest >= STRONG * largest.max()].min())


def fit_on_trajectories(
    training: Sequence[ReducedTrajectory],
    order: int,
    internal_resonance: Resonance,
    ridge: float,
    known: LinearPart | None = None,
) -> NormalFormFit:
    """Return the last of ``growing_fits`` up to ``order``, every sample counted, with its replicates.

    Parameters
    ----------
    training : uniform, at least 20 periods long.
    order, internal_resonance : as in ``normal_form.fit_normal_form``.
    ridge : of the linear part and of the inverse chart; refinement has priors of its own.
    known : linear part to keep; None fits it too.

    Raises
    ------
    NumericalError : the linear part does not decay, or no start stays bounded.
    """
    everything = [np.ones(len(r.t), dtype=bool) for r in training]
    last = next(_grown(training, everything, (order,), (internal_resonance, ridge, known)))
    others = replicates(last.model, last.segments, last.max_step, last.reference.without)
    spread = Replicates(np.array([o.eigenvalues for o in others]), np.array([o.B for o in others]))
    begun = "band-passed signals" if last.start.direct is None else "the direct fit"
    return replace(last.normal_form(ridge), replicates=spread, origin=FitOrigin(begun, last.reference.origin))


def growing_orders(order: int) -> list[int]:
    """Return 3, 5, .. up to ``order``, itself included."""
    return sorted({*range(min(order, START_ORDER), order, 2), order})


def growing_fits(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: Sequence[int],
    settings: tuple[Resonance, float, LinearPart | None],
) -> Iterator[NormalFormFit]:
    """Start at order 3 from band-passed modes or the direct fit, refine, grow to the next odd order, refine, ..

    An order that is asked for is then refined once more with dissipation demanded in and around the trained range;
    growth goes on from the fit without. Up to order 5 every motion is first cut into segments with initial states of
    their own: over a whole motion the frequencies of the start are wrong by periods, and the cost has minima that are
    off by one.

    Parameters
    ----------
    training : uniform, at least 20 periods long.
    kept : (n_time,) per trajectory, samples that count; simulation passes through the others.
    orders : those to yield, increasing.
    settings : internal resonance; ridge of the linear part and of the inverse chart; linear part to keep or None.

    Yields
    ------
    The normal form of each of the ``orders``.
    """
    for state in _grown(training, kept, orders, settings):
        yield state.normal_form(settings[1])


@dataclass(frozen=True)
class _Refined:
    """What refinement has reached at one order."""

    start: Start
    reference: LinearReference
    model: RefinedDynamics
    segments: tuple[Segment, ...]
    table: ResonanceTable
    max_step: float

    def normal_form(self, ridge: float) -> NormalFormFit:
        return refined_normal_form(self.start.dynamics, self.model, self.table, self.segments, (ridge, self.max_step))


def _grown(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: Sequence[int],
    settings: tuple[Resonance, float, LinearPart | None],
) -> Iterator[_Refined]:
    internal_resonance = settings[0]
    grown = sorted({*growing_orders(orders[0]), *orders})
    (start, reference), shooting, shots = _best_start(training, kept, (min(grown[0], START_ORDER), grown[0]), settings)
    dynamics = start.dynamics
    whole = segments(start, training, kept, 1)
    first = [next(k for k, s in enumerate(shots) if s.motion == number) for number in range(len(training))]
    model = shooting
    for order in grown:
        table = resonance_table(dynamics.eigenvalues, order, internal_resonance)
        max_step = largest_resonant_step(dynamics.eigenvalues, table)
        if order <= SHOT_ORDER or order == grown[0]:
            if order > grown[0]:
                shooting, shots = refine(regrown(shooting, table), shots, max_step, SHOT_STEPS, SHOT_DECREASE)
            model = shooting
            whole = tuple(replace(s, z0=shots[k].z0) for s, k in zip(whole, first, strict=True))
        model, whole = refine(regrown(model, table), whole, max_step, STEPS, DECREASE)
        if order in orders:
            yield _Refined(start, reference, *dissipative(model, whole, max_step), table, max_step)


def _best_start(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: tuple[int, int],
    settings: tuple[Resonance, float, LinearPart | None],
) -> tuple[tuple[Start, LinearReference], RefinedDynamics, tuple[Segment, ...]]:
    """Return the start from which multiple shooting comes to the lower cost on the samples that count.

    The direct fit must win by a tenth: band-passed signals know the limit of small motions, which a cost of low order
    does not value.

    Parameters
    ----------
    orders : of the direct fit, which has the linear part of all starts; of the refinement.
    """
    internal_resonance, ridge, known = settings
    seen = [r.masked(keep) for r, keep in zip(training, kept, strict=True)]
    direct = fit_normal_form(seen, orders[0], internal_resonance, ridge, known)
    table = resonance_table(direct.dynamics.eigenvalues, orders[1], internal_resonance)
    max_step = largest_resonant_step(direct.dynamics.eigenvalues, table)
    found = []
    for start in (band_passed(direct.dynamics, training), charted(direct, training)):
        reference = linear_reference(start, training, kept, table, (ridge, known is not None))
        tie = reference.eigenvalues, reference.spread
        model = start_model(start, training, kept, table, tie, keep_linear=known is not None)
        shots = segments(start, training, kept, SHOTS)
        found.append(((start, reference), *refine(model, shots, max_step, SHOT_STEPS, SHOT_DECREASE)))
    band, direct_start = found
    if not np.isfinite([band[1].cost, direct_start[1].cost]).any():
        raise NumericalError(
            "all starts of the fit on trajectories blow up",
            where="learn",
            advice="lower the order, give longer decays, or leave out motions that exchange energy faster",
        )
    return direct_start if direct_start[1].cost < IMPROVED * band[1].cost else band


def largest_resonant_step(eigenvalues: ComplexArray, table: ResonanceTable) -> float:
    """Return the internal step in s: a share of the fastest period, and of the slow turn of the terms kept.

    A term with detuning d adds (d h)^4 / 2880 of itself per unit of time to the error (Simpson's rule).
    """
    turn = float(np.abs(table.detuning[table.resonant]).max(initial=0.0))
    shortest = 2.0 * np.pi / float(eigenvalues.imag.max()) / STEPS_PER_PERIOD
    return min(shortest, LARGEST_TURN / max(turn, np.finfo(float).tiny))
