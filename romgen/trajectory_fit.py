"""A normal form fitted on whole trajectories: band-passed start, multiple shooting, growing order, refinement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from romgen.arrays import BoolArray, ComplexArray
from romgen.chart import ReducedTrajectory
from romgen.differences import DROPPED, first_derivative, is_uniform
from romgen.dissipative_fit import dissipative
from romgen.jackknife import Replicates, blocks_of
from romgen.metrics import analytic_signal
from romgen.normal_form import NormalFormFit, Resonance, resonance_table
from romgen.output_map import output_map
from romgen.polynomial import monomials, zeta
from romgen.reduced_dynamics import LinearPart, ReducedDynamics, fit_reduced_dynamics, modal_samples
from romgen.refined_chart import refined_normal_form
from romgen.refinement import RefinedDynamics, Segment, refine, regrown, replicates
from romgen.regression import ridge_fit
from romgen.resonance import ResonanceTable

START_ORDER = 3
# Lower edge of the first band and upper edge of the last, as shares of the modal frequency.
BAND = (0.5, 1.5)
# z'/z counts alike at all amplitudes above this share of the largest: phase drift is what the start must get right.
AMPLITUDE_FLOOR = 0.06
EDGE_PERIODS = 1.0
MIN_PERIODS = 20.0
SAMPLES_PER_PERIOD = 6.0
# Segments per motion up to SHOT_ORDER: short enough that the rates of the start lose no period within one. Two blocks
# of the cross-validation make one, so every segment has samples that count.
SHOTS, SHOT_ORDER = 4, 5
SHOT_STEPS, SHOT_DECREASE = 12, 1e-3
STEPS, DECREASE = 30, 1e-4


def is_long_enough(training: Sequence[ReducedTrajectory]) -> bool:
    """Whether every trajectory is uniform and has 20 periods of its slowest strong motion, as band-passing needs.

    A period is two sign changes of the first modal coordinate.
    """
    return all(is_uniform(r.t) and _periods(r) >= MIN_PERIODS for r in training)


def _periods(r: ReducedTrajectory) -> float:
    return 0.5 * float(np.count_nonzero(np.diff(np.signbit(r.y[:, 0]))))


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
    NumericalError : the linear part does not decay.
    """
    everything = [np.ones(len(r.t), dtype=bool) for r in training]
    last = next(_grown(training, everything, (order,), (internal_resonance, ridge, known)))
    table = resonance_table(last.dynamics.eigenvalues, min(order, START_ORDER), internal_resonance)
    references = _references(training, last.dynamics, table, keep_linear=known is not None)
    others = replicates(last.model, last.segments, last.max_step, references)
    spread = Replicates(np.array([o.eigenvalues for o in others]), np.array([o.B for o in others]))
    return replace(last.normal_form(ridge), replicates=spread)


def growing_orders(order: int) -> list[int]:
    """Return 3, 5, .. up to ``order``, itself included."""
    return sorted({*range(min(order, START_ORDER), order, 2), order})


def growing_fits(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: Sequence[int],
    settings: tuple[Resonance, float, LinearPart | None],
) -> Iterator[NormalFormFit]:
    """Start from band-passed modal coordinates at order 3, refine, grow to the next odd order, refine, ..

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

    dynamics: ReducedDynamics
    model: RefinedDynamics
    segments: tuple[Segment, ...]
    table: ResonanceTable
    max_step: float

    def normal_form(self, ridge: float) -> NormalFormFit:
        return refined_normal_form(self.dynamics, self.model, self.table, self.segments, (ridge, self.max_step))


def _grown(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: Sequence[int],
    settings: tuple[Resonance, float, LinearPart | None],
) -> Iterator[_Refined]:
    internal_resonance, ridge, known = settings
    grown = sorted({*growing_orders(orders[0]), *orders})
    seen = [masked(r, keep) for r, keep in zip(training, kept, strict=True)]
    dynamics = fit_reduced_dynamics(seen, min(grown[0], START_ORDER), ridge, known)
    signals = [_signals(dynamics, r) for r in training]
    table = resonance_table(dynamics.eigenvalues, grown[0], internal_resonance)
    model = _start(dynamics, training, (signals, kept), table, keep_linear=known is not None)
    max_step = 2.0 * np.pi / (20.0 * float(dynamics.eigenvalues.imag.max()))
    shots = _segments(dynamics, training, (signals, kept), SHOTS)
    whole = _segments(dynamics, training, (signals, kept), 1)
    first = [next(k for k, s in enumerate(shots) if s.motion == number) for number in range(len(training))]
    shooting = model
    for order in grown:
        table = resonance_table(dynamics.eigenvalues, order, internal_resonance)
        if order <= SHOT_ORDER or order == grown[0]:
            shooting, shots = refine(regrown(shooting, table), shots, max_step, SHOT_STEPS, SHOT_DECREASE)
            model = shooting
            whole = tuple(replace(s, z0=shots[k].z0) for s, k in zip(whole, first, strict=True))
        model, whole = refine(regrown(model, table), whole, max_step, STEPS, DECREASE)
        if order in orders:
            yield _Refined(dynamics, *dissipative(model, whole, max_step), table, max_step)


def masked(r: ReducedTrajectory, keep: BoolArray) -> ReducedTrajectory:
    """Return the samples of a trajectory where ``keep`` (n_time,) is True."""
    return ReducedTrajectory(r.name, r.t[keep], r.y[keep], r.y_dot[keep], r.displacement[keep], r.velocity[keep])


def _signals(dynamics: ReducedDynamics, r: ReducedTrajectory) -> ComplexArray:
    """Return z ~ the analytic signal of each modal coordinate in its own band."""
    f = dynamics.eigenvalues.imag / (2.0 * np.pi)
    edges = np.concatenate([[BAND[0] * f[0]], np.sqrt(f[1:] * f[:-1]), [BAND[1] * f[-1]]])
    q = modal_samples(dynamics, r)[0].real
    bands = [(float(edges[j]), float(edges[j + 1])) for j in range(len(f))]
    return np.column_stack([analytic_signal(r.t, q[:, j], band) for j, band in enumerate(bands)])


def _edge(r: ReducedTrajectory, eigenvalues: ComplexArray) -> int:
    """Return the samples in EDGE_PERIODS of the slowest mode, where a band-pass is distorted."""
    return int(np.ceil(EDGE_PERIODS * 2.0 * np.pi / float(eigenvalues.imag.min()) / (r.t[1] - r.t[0])))


def _start(
    dynamics: ReducedDynamics,
    training: Sequence[ReducedTrajectory],
    signals: tuple[Sequence[ComplexArray], Sequence[BoolArray]],
    table: ResonanceTable,
    *,
    keep_linear: bool,
) -> RefinedDynamics:
    """Return Lambda and B of the band-passed signals, the linear displacement of the modes, and no further terms.

    ``keep_linear`` keeps the eigenvalues of ``dynamics`` here and in the refinement.
    """
    m = len(dynamics.eigenvalues)
    eigenvalues, B = _rates(dynamics, training, signals, table, keep_linear=keep_linear)
    # w = 2 Re(V q), so eta_j = s_j Re(2 V_jj z_j) and the rest
    linear = 2.0 * dynamics.scale[:m] * np.diag(dynamics.vectors[:m])
    output = output_map(linear.astype(np.complex128), table)
    amplitude = np.max([np.abs(z[keep]).max(axis=0) for z, keep in zip(*signals, strict=True)], axis=0)
    return RefinedDynamics(
        eigenvalues=eigenvalues,
        reference=eigenvalues,
        keep_linear=keep_linear,
        amplitude=amplitude,
        exponents=table.exponents,
        resonant=table.resonant,
        B=B,
        output=output,
        C=np.zeros(output.terms.shape, dtype=np.complex128),
        rest=np.zeros((len(training), m)),
    )


def _rates(
    dynamics: ReducedDynamics,
    training: Sequence[ReducedTrajectory],
    signals: tuple[Sequence[ComplexArray], Sequence[BoolArray]],
    table: ResonanceTable,
    *,
    keep_linear: bool,
) -> tuple[ComplexArray, ComplexArray]:
    """Return Lambda and B of z' = Lambda z + B phi(z) by regression with weights 1/(abs(z_j) + floor)."""
    z, rate = [], []
    for r, signal, keep in zip(training, *signals, strict=True):
        edge = _edge(r, dynamics.eigenvalues)
        inner = keep[DROPPED:-DROPPED].copy()
        inner[:edge], inner[-edge:] = False, False
        parts = np.hstack([signal.real, signal.imag])
        derivative = first_derivative(parts, float(r.t[1] - r.t[0]))
        m = signal.shape[1]
        z.append(signal[DROPPED:-DROPPED][inner])
        rate.append((derivative[:, :m] + 1j * derivative[:, m:])[inner])
    Z, Z_dot = np.vstack(z), np.vstack(rate)
    B = np.zeros(table.resonant.shape, dtype=np.complex128)
    eigenvalues = dynamics.eigenvalues.copy()
    for j, kept in enumerate(table.resonant):
        weight = 1.0 / (np.abs(Z[:, j : j + 1]) + AMPLITUDE_FLOOR * np.abs(Z[:, j]).max())
        own, terms = Z[:, j : j + 1] * weight, monomials(zeta(Z), table.exponents[kept]) * weight
        rate_j = Z_dot[:, j : j + 1] * weight
        if keep_linear:
            B[j, kept] = ridge_fit(terms, rate_j - eigenvalues[j] * own, 0.0)[0]
        else:
            row = ridge_fit(np.hstack([own, terms]), rate_j, 0.0)[0]
            eigenvalues[j], B[j, kept] = row[0], row[1:]
    return eigenvalues, B


def _references(
    training: Sequence[ReducedTrajectory], dynamics: ReducedDynamics, table: ResonanceTable, *, keep_linear: bool
) -> ComplexArray:
    """Return the eigenvalues of the start without each block, (n_block, m): they come from the same data."""
    signals, block = [_signals(dynamics, r) for r in training], blocks_of(training)
    ends = np.cumsum([len(r.t) for r in training])[:-1]
    kept = [np.split(block != b, ends) for b in range(block.max() + 1)]
    rates = (_rates(dynamics, training, (signals, masks), table, keep_linear=keep_linear) for masks in kept)
    return np.array([eigenvalues for eigenvalues, _ in rates])


def _segments(
    dynamics: ReducedDynamics,
    training: Sequence[ReducedTrajectory],
    signals: tuple[Sequence[ComplexArray], Sequence[BoolArray]],
    n: int,
) -> tuple[Segment, ...]:
    """Return n segments of each motion that have samples that count, thinned to a few per period of the fastest mode.

    Initial states are those of the signals, at the start from its first undistorted sample, turned back by the linear
    part.
    """
    period = 2.0 * np.pi / float(dynamics.eigenvalues.imag.max())
    m = len(dynamics.eigenvalues)
    segments = []
    for number, (r, signal, keep) in enumerate(zip(training, *signals, strict=True)):
        edge = _edge(r, dynamics.eigenvalues)
        stride = max(1, int(period / (SAMPLES_PER_PERIOD * (r.t[1] - r.t[0]))))
        share = 1.0 / float(np.linalg.norm(r.y[keep, :m], axis=1).max())
        bounds = np.arange(n + 1) * len(r.t) // n
        for k, (first, last) in enumerate(pairwise(bounds)):
            rows = slice(int(first), int(last), stride)
            if k > 0 and not keep[rows].any():
                continue
            turned = signal[edge] * np.exp(-dynamics.eigenvalues * (r.t[edge] - r.t[0]))
            z0 = turned if k == 0 else signal[first]
            segments.append(Segment(r.t[rows], r.y[rows, :m], z0, keep[rows], number, share))
    return tuple(segments)
