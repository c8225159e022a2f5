"""A normal form fitted on whole trajectories: band-passed start, growing order, refinement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from romgen.arrays import BoolArray, ComplexArray
from romgen.chart import ReducedTrajectory
from romgen.differences import DROPPED, first_derivative, is_uniform
from romgen.metrics import analytic_signal
from romgen.normal_form import NormalFormFit, Resonance, chart_from, relative_error_percent, resonance_table
from romgen.polynomial import PolynomialMap, evaluate, exponents, monomials, zeta
from romgen.reduced_dynamics import ReducedDynamics, fit_reduced_dynamics, modal_samples
from romgen.refinement import RefinedDynamics, Segment, grown, refine
from romgen.regression import ridge_fit
from romgen.resonance import ResonanceTable
from romgen.variational import sensitivities

START_ORDER = 3
# Lower edge of the first band and upper edge of the last, as shares of the modal frequency.
BAND = (0.5, 1.5)
# z'/z counts alike at all amplitudes above this share of the largest: phase drift is what the start must get right.
AMPLITUDE_FLOOR = 0.06
EDGE_PERIODS = 1.0
MIN_PERIODS = 20.0
SAMPLES_PER_PERIOD = 5.0
STEPS = 30
RIDGE = 1e-6


def is_long_enough(training: Sequence[ReducedTrajectory]) -> bool:
    """Whether every trajectory is uniform and has 20 periods of its slowest strong motion, as band-passing needs.

    A period is two sign changes of the first modal coordinate.
    """
    return all(is_uniform(r.t) and _periods(r) >= MIN_PERIODS for r in training)


def _periods(r: ReducedTrajectory) -> float:
    return 0.5 * float(np.count_nonzero(np.diff(np.signbit(r.y[:, 0]))))


def fit_on_trajectories(
    training: Sequence[ReducedTrajectory], order: int, internal_resonance: Resonance, ridge: float
) -> NormalFormFit:
    """Return the last of ``growing_fits`` up to ``order``, every sample counted.

    Parameters
    ----------
    training : uniform, at least 20 periods long.
    order, internal_resonance : as in ``normal_form.fit_normal_form``.
    ridge : of the linear part and of the inverse chart; refinement has its own, ``RIDGE``.

    Raises
    ------
    NumericalError : the linear part does not decay.
    """
    everything = [np.ones(len(r.t), dtype=bool) for r in training]
    orders = sorted({*range(min(order, START_ORDER), order, 2), order})
    return list(growing_fits(training, everything, orders, (internal_resonance, ridge), STEPS))[-1]


def growing_fits(
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    orders: Sequence[int],
    settings: tuple[Resonance, float],
    steps: int,
) -> Iterator[NormalFormFit]:
    """Start from band-passed modal coordinates at the first order, refine, grow to the next, refine, ..

    Parameters
    ----------
    training : uniform, at least 20 periods long.
    kept : (n_time,) per trajectory, samples that count; simulation passes through the others.
    orders : increasing.
    settings : internal resonance; ridge of the linear part and of the inverse chart.
    steps : largest number of Levenberg-Marquardt steps per order.

    Yields
    ------
    The normal form of each order.
    """
    internal_resonance, ridge = settings
    seen = [masked(r, keep) for r, keep in zip(training, kept, strict=True)]
    dynamics = fit_reduced_dynamics(seen, min(orders[0], START_ORDER), ridge)
    table = resonance_table(dynamics.eigenvalues, orders[0], internal_resonance)
    signals = [_signals(dynamics, r) for r in training]
    eigenvalues, B = _rates(dynamics, training, (signals, kept), table)
    model = RefinedDynamics(
        eigenvalues, eigenvalues, table.exponents, table.resonant, ~table.resonant, B, np.zeros_like(B)
    )
    segments = tuple(_segment(dynamics, *parts) for parts in zip(training, signals, kept, strict=True))
    max_step = 2.0 * np.pi / (20.0 * float(dynamics.eigenvalues.imag.max()))
    for order in orders:
        table = resonance_table(dynamics.eigenvalues, order, internal_resonance)
        model, segments = refine(grown(model, table.exponents, table.resonant), segments, RIDGE, max_step, steps)
        yield _normal_form(dynamics, model, table, segments, ridge)


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


def _rates(
    dynamics: ReducedDynamics,
    training: Sequence[ReducedTrajectory],
    signals: tuple[Sequence[ComplexArray], Sequence[BoolArray]],
    table: ResonanceTable,
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
    eigenvalues = np.zeros(Z.shape[1], dtype=np.complex128)
    for j, kept in enumerate(table.resonant):
        weight = 1.0 / (np.abs(Z[:, j : j + 1]) + AMPLITUDE_FLOOR * np.abs(Z[:, j]).max())
        columns = np.hstack([Z[:, j : j + 1], monomials(zeta(Z), table.exponents[kept])])
        row = ridge_fit(columns * weight, Z_dot[:, j : j + 1] * weight, 0.0)[0]
        eigenvalues[j], B[j, kept] = row[0], row[1:]
    return eigenvalues, B


def _segment(dynamics: ReducedDynamics, r: ReducedTrajectory, signal: ComplexArray, keep: BoolArray) -> Segment:
    """Return the whole trajectory, thinned to a few samples per period of the fastest mode.

    The start comes from the first undistorted sample of the signal, turned back by the linear part.
    """
    edge = _edge(r, dynamics.eigenvalues)
    start = signal[edge] * np.exp(-dynamics.eigenvalues * (r.t[edge] - r.t[0]))
    period = 2.0 * np.pi / float(dynamics.eigenvalues.imag.max())
    stride = max(1, int(period / (SAMPLES_PER_PERIOD * (r.t[1] - r.t[0]))))
    q = modal_samples(dynamics, r)[0]
    return Segment(r.t[::stride], q[::stride], start, keep[::stride])


def _normal_form(
    dynamics: ReducedDynamics,
    model: RefinedDynamics,
    table: ResonanceTable,
    segments: Sequence[Segment],
    ridge: float,
) -> NormalFormFit:
    """Return the refined model with its charts; the inverse chart is regressed on the simulated trajectories."""
    none = np.zeros(0, dtype=np.int64)
    max_step = 2.0 * np.pi / (20.0 * float(dynamics.eigenvalues.imag.max()))
    normal_form = PolynomialMap(model.exponents, model.B)
    z = np.vstack(
        [
            sensitivities(s.t, s.z0, model.eigenvalues, (model.exponents, model.B), (none, none), max_step)[0][s.kept]
            for s in segments
        ]
    )
    w = 2.0 * (np.vstack([s.q[s.kept] for s in segments]) @ dynamics.vectors.T).real
    E = exponents(w.shape[1], 1, int(model.exponents.sum(axis=1).max()))
    H = ridge_fit(monomials(w, E).astype(np.complex128), z, ridge)
    chart = chart_from(dynamics, model.exponents, model.C)
    return NormalFormFit(
        dynamics=replace(dynamics, eigenvalues=model.eigenvalues),
        resonance=table,
        conjugacy=None,
        normal_form=normal_form,
        chart=chart,
        inverse_chart=PolynomialMap(E, H),
        chart_error_percent=relative_error_percent(w, evaluate(chart, zeta(z)).real),
    )
