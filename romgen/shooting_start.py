"""Where the refinement on trajectories starts: approximate normal-form coordinates of the data, and what follows.

Two ways lead from modal coordinates to z(t). Band-passing takes what modulates each mode slowly, of any order, but
mixes modes that exchange energy within a few periods. The inverse chart of the direct fit holds the exchange, but of
the order of that fit only, and it carries the noise of the velocities. Which of them is the better start is for the
data to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.differences import DROPPED, first_derivative
from romgen.jackknife import blocks_of
from romgen.metrics import analytic_signal
from romgen.normal_form import NormalFormFit
from romgen.output_map import output_map
from romgen.polynomial import evaluate, monomials, zeta
from romgen.reduced_dynamics import ReducedDynamics, modal_samples
from romgen.refined_dynamics import RefinedDynamics, Segment
from romgen.regression import ridge_fit
from romgen.resonance import ResonanceTable

# Lower edge of the first band and upper edge of the last, as shares of the modal frequency.
BAND = (0.5, 1.5)
# z'/z counts alike at all amplitudes above this share of the largest: phase drift is what the start must get right.
AMPLITUDE_FLOOR = 0.06
EDGE_PERIODS = 1.0
SAMPLES_PER_PERIOD = 6.0


@dataclass(frozen=True)
class Start:
    """Approximate normal-form coordinates of all training motions.

    Attributes
    ----------
    dynamics : the linear part they belong to.
    signals : z (n_time, m) per motion.
    edge : samples at both ends of each motion in which they are distorted.
    direct : the direct fit that they come from; None where they are band-passed.
    """

    dynamics: ReducedDynamics
    signals: tuple[ComplexArray, ...] = field(metadata={"unit": "1", "axes": "time,mode"})
    edge: tuple[int, ...]
    direct: NormalFormFit | None = None


def band_passed(dynamics: ReducedDynamics, training: Sequence[ReducedTrajectory]) -> Start:
    """Return z ~ the analytic signal of each modal coordinate in its own band."""
    f = dynamics.eigenvalues.imag / (2.0 * np.pi)
    edges = np.concatenate([[BAND[0] * f[0]], np.sqrt(f[1:] * f[:-1]), [BAND[1] * f[-1]]])
    bands = [(float(low), float(high)) for low, high in pairwise(edges)]
    signals = []
    for r in training:
        q = modal_samples(dynamics, r)[0].real
        signals.append(np.column_stack([analytic_signal(r.t, q[:, j], band) for j, band in enumerate(bands)]))
    # a band-pass is distorted within EDGE_PERIODS of the slowest mode
    width = tuple(int(np.ceil(EDGE_PERIODS / f.min() / (r.t[1] - r.t[0]))) for r in training)
    return Start(dynamics, tuple(signals), width)


def charted(fit: NormalFormFit, training: Sequence[ReducedTrajectory]) -> Start:
    """Return z of the inverse chart of a direct fit."""
    signals = tuple(evaluate(fit.inverse_chart, r.y / fit.dynamics.scale) for r in training)
    return Start(fit.dynamics, signals, (0,) * len(training), fit)


def start_model(
    start: Start,
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    table: ResonanceTable,
    tie: tuple[ComplexArray, ComplexArray],
    *,
    keep_linear: bool,
) -> RefinedDynamics:
    """Return Lambda and B of the signals, the linear displacement of the modes, and no further terms.

    Parameters
    ----------
    kept : (n_time,) per trajectory, samples that count.
    tie : (m,) what the eigenvalues are tied to in the refinement, and its standard deviations.
    keep_linear : keep the eigenvalues of the start here and in the refinement.
    """
    dynamics, m = start.dynamics, len(start.dynamics.eigenvalues)
    eigenvalues, B = rates(start, training, kept, table, keep_linear=keep_linear)
    # w = 2 Re(V q), so eta_j = s_j Re(2 V_jj z_j) and the rest
    linear = 2.0 * dynamics.scale[:m] * np.diag(dynamics.vectors[:m])
    output = output_map(linear.astype(np.complex128), table)
    return RefinedDynamics(
        eigenvalues=eigenvalues,
        reference=tie[0],
        spread=tie[1],
        keep_linear=keep_linear,
        amplitude=np.max([np.abs(z[keep]).max(axis=0) for z, keep in zip(start.signals, kept, strict=True)], axis=0),
        exponents=table.exponents,
        resonant=table.resonant,
        B=B,
        output=output,
        C=np.zeros(output.terms.shape, dtype=np.complex128),
        rest=np.zeros((len(training), m)),
    )


def rates(
    start: Start,
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    table: ResonanceTable,
    *,
    keep_linear: bool,
) -> tuple[ComplexArray, ComplexArray]:
    """Return Lambda and B of z' = Lambda z + B phi(z) by regression with weights 1/(abs(z_j) + floor)."""
    return regression(start, samples(start, training, kept)[:2], table, keep_linear=keep_linear)


def regression(
    start: Start, samples: tuple[ComplexArray, ComplexArray], table: ResonanceTable, *, keep_linear: bool
) -> tuple[ComplexArray, ComplexArray]:
    """Return Lambda and B from z and z' (n_sample, m)."""
    Z, Z_dot = samples
    B = np.zeros(table.resonant.shape, dtype=np.complex128)
    eigenvalues = start.dynamics.eigenvalues.copy()
    for j, terms_kept in enumerate(table.resonant):
        weight = 1.0 / (np.abs(Z[:, j : j + 1]) + AMPLITUDE_FLOOR * np.abs(Z[:, j]).max())
        own, terms = Z[:, j : j + 1] * weight, monomials(zeta(Z), table.exponents[terms_kept]) * weight
        rate_j = Z_dot[:, j : j + 1] * weight
        if keep_linear:
            B[j, terms_kept] = ridge_fit(terms, rate_j - eigenvalues[j] * own, 0.0)[0]
        else:
            row = ridge_fit(np.hstack([own, terms]), rate_j, 0.0)[0]
            eigenvalues[j], B[j, terms_kept] = row[0], row[1:]
    return eigenvalues, B


def samples(
    start: Start, training: Sequence[ReducedTrajectory], kept: Sequence[BoolArray]
) -> tuple[ComplexArray, ComplexArray, IntArray]:
    """Return z, z' (n_sample, m) and number of the block of the samples that count and are not distorted."""
    z, rate, block = [], [], []
    ends = np.cumsum([len(r.t) for r in training])[:-1]
    own = np.split(blocks_of(training), ends)
    for r, signal, edge, keep, number in zip(training, start.signals, start.edge, kept, own, strict=True):
        inner = keep[DROPPED:-DROPPED].copy()
        inner[:edge], inner[len(inner) - edge :] = False, False
        m = signal.shape[1]
        derivative = first_derivative(np.hstack([signal.real, signal.imag]), float(r.t[1] - r.t[0]))
        z.append(signal[DROPPED:-DROPPED][inner])
        rate.append((derivative[:, :m] + 1j * derivative[:, m:])[inner])
        block.append(number[DROPPED:-DROPPED][inner])
    return np.vstack(z), np.vstack(rate), np.concatenate(block)


def segments(
    start: Start, training: Sequence[ReducedTrajectory], kept: Sequence[BoolArray], n: int
) -> tuple[Segment, ...]:
    """Return n segments of each motion that have samples that count, thinned to a few per period of the fastest mode.

    A motion begins with its first sample that counts: before it, at amplitudes that no sample of the fit has, the model
    may blow up. Initial states are those of the signals, where these are distorted from the first sample that is not,
    turned back by the linear part.
    """
    eigenvalues = start.dynamics.eigenvalues
    m, period = len(eigenvalues), 2.0 * np.pi / float(eigenvalues.imag.max())
    found = []
    for number, (r, signal, edge, keep) in enumerate(zip(training, start.signals, start.edge, kept, strict=True)):
        stride = max(1, int(period / (SAMPLES_PER_PERIOD * (r.t[1] - r.t[0]))))
        share = 1.0 / float(np.linalg.norm(r.y[keep, :m], axis=1).max())
        bounds = np.arange(n + 1) * len(r.t) // n
        begin = int(keep.argmax())
        for first, last in pairwise(np.maximum(bounds, begin)):
            rows = slice(int(first), int(last), stride)
            if not keep[rows].any():
                continue
            clear = max(edge, int(first)) if first == begin else int(first)
            z0 = signal[clear] * np.exp(-eigenvalues * (r.t[clear] - r.t[first]))
            found.append(Segment(r.t[rows], r.y[rows, :m], z0, keep[rows], number, share))
    return tuple(found)
