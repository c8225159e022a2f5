"""A normal form fitted on whole trajectories: band-passed start, growing order, refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from romgen.arrays import ComplexArray
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


def is_long_enough(training: Sequence[ReducedTrajectory], eigenvalues: ComplexArray) -> bool:
    """Whether every trajectory is uniform and has 20 periods of the slowest mode, as band-passing needs."""
    period = 2.0 * np.pi / float(eigenvalues.imag.min())
    return all(is_uniform(r.t) and r.t[-1] - r.t[0] >= MIN_PERIODS * period for r in training)


def fit_on_trajectories(
    training: Sequence[ReducedTrajectory], order: int, internal_resonance: Resonance, ridge: float
) -> NormalFormFit:
    """Start from band-passed modal coordinates at order 3, refine, raise the order by 2, refine, .. up to ``order``.

    Parameters
    ----------
    training : uniform, at least 20 periods long.
    ridge : of the linear part and of the inverse chart; refinement has its own, ``RIDGE``.

    Raises
    ------
    NumericalError : the linear part does not decay.
    """
    dynamics = fit_reduced_dynamics(training, min(order, START_ORDER), ridge)
    table = resonance_table(dynamics.eigenvalues, min(order, START_ORDER), internal_resonance)
    signals = [_signals(dynamics, r) for r in training]
    eigenvalues, B = _rates(dynamics, training, signals, table)
    model = RefinedDynamics(
        eigenvalues, eigenvalues, table.exponents, table.resonant, ~table.resonant, B, np.zeros_like(B)
    )
    segments = tuple(_segment(dynamics, r, z) for r, z in zip(training, signals, strict=True))
    max_step = 2.0 * np.pi / (20.0 * float(dynamics.eigenvalues.imag.max()))
    for degree in sorted({*range(min(order, START_ORDER), order, 2), order}):
        table = resonance_table(dynamics.eigenvalues, degree, internal_resonance)
        model, segments = refine(grown(model, table.exponents, table.resonant), segments, RIDGE, max_step, STEPS)
    return _normal_form(dynamics, model, table, segments, ridge)


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
    signals: Sequence[ComplexArray],
    table: ResonanceTable,
) -> tuple[ComplexArray, ComplexArray]:
    """Return Lambda and B of z' = Lambda z + B phi(z) by regression with weights 1/(abs(z_j) + floor)."""
    z, rate = [], []
    for r, signal in zip(training, signals, strict=True):
        edge = _edge(r, dynamics.eigenvalues)
        inner = slice(edge, -edge)
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


def _segment(dynamics: ReducedDynamics, r: ReducedTrajectory, signal: ComplexArray) -> Segment:
    """Return the whole trajectory, thinned to a few samples per period of the fastest mode.

    The start comes from the first undistorted sample of the signal, turned back by the linear part.
    """
    edge = _edge(r, dynamics.eigenvalues)
    start = signal[edge] * np.exp(-dynamics.eigenvalues * (r.t[edge] - r.t[0]))
    period = 2.0 * np.pi / float(dynamics.eigenvalues.imag.max())
    stride = max(1, int(period / (SAMPLES_PER_PERIOD * (r.t[1] - r.t[0]))))
    q = modal_samples(dynamics, r)[0]
    return Segment(r.t[::stride], q[::stride], start)


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
            sensitivities(s.t, s.z0, model.eigenvalues, (model.exponents, model.B), (none, none), max_step)[0]
            for s in segments
        ]
    )
    w = 2.0 * (np.vstack([s.q for s in segments]) @ dynamics.vectors.T).real
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
