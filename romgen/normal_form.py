"""The extended normal form of the reduced dynamics: resonant terms, conjugacy fit, chart and inverse chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.conjugacy import ConjugacyFit, homological_start, settle_conjugacy
from romgen.errors import NumericalError
from romgen.jackknife import Replicates, conjugacy_replicates
from romgen.polynomial import PolynomialMap, evaluate, exponents, monomials, zeta
from romgen.reduced_dynamics import LinearPart, ReducedDynamics, fit_reduced_dynamics, modal_samples
from romgen.regression import ridge_fit
from romgen.resonance import ResonanceTable, automatic_resonance, gap_resonance, integer_resonance, trivial_resonance
from romgen.substitution import substitute_linear
from romgen.trained_range import TrainedRange, trained_range

# Rows used by the conjugacy fit: a few thousand phases and amplitudes determine all coefficients.
FIT_SAMPLES = 4000
# Rows used by the regression of the chart, whose error is then measured on all.
CHART_SAMPLES = 12_000
# Terms above degree 3 take a ridge 10^degree times stronger: few motions leave them free between their amplitudes.
FREE_DEGREE, GRADE = 3, 10.0

Resonance = tuple[int, ...] | Literal["auto", "gap"]


@dataclass(frozen=True)
class FitOrigin:
    """Where a fit on trajectories began and what its linear part is tied to.

    Attributes
    ----------
    start : "band-passed signals" or "the direct fit".
    linear : "small motions", "all amplitudes", "the direct fit", or "given" where it is kept.
    """

    start: str
    linear: str


@dataclass(frozen=True)
class NormalFormFit:
    """A normal form with its coordinate changes over the scaled coordinates w = y / s.

    Attributes
    ----------
    dynamics : the polynomial vector field it was made from, with scale, eigenvalues and modal directions.
    resonance : the terms kept.
    conjugacy : A, B, cost and deviations; None where the form was fitted on trajectories.
    normal_form : N, (m, n_term) over zeta, nonlinear terms, 1/s.
    chart : T, (2m, n_term) over zeta, w = Re(T zeta^E).
    inverse_chart : H, (m, n_term) over w.
    trained_range : amplitudes of the training motions.
    chart_error_percent : mean over samples of abs(w - Re(T zeta^E)) over the largest abs(w).
    replicates : coefficients without a block of the data each; None where they were not asked for.
    origin : start of a fit on trajectories; None for others.
    """

    dynamics: ReducedDynamics
    resonance: ResonanceTable
    conjugacy: ConjugacyFit | None
    normal_form: PolynomialMap[np.complex128]
    chart: PolynomialMap[np.complex128]
    inverse_chart: PolynomialMap[np.complex128]
    trained_range: TrainedRange
    chart_error_percent: float
    replicates: Replicates | None = None
    origin: FitOrigin | None = None


def fit_normal_form(
    training: Sequence[ReducedTrajectory],
    order: int,
    internal_resonance: Resonance,
    ridge: float,
    known: LinearPart | None = None,
) -> NormalFormFit:
    """Fit R, keep the resonant terms, minimise the conjugacy cost with growing order, invert the chart.

    Parameters
    ----------
    training : trajectories in reduced coordinates.
    order : f, largest degree.
    internal_resonance : integers r_j, () for none, "auto" (integers) or "gap" (by size).
    ridge : of every regression and of A and B.
    known : linear part to keep; None fits it too.

    Raises
    ------
    NumericalError : the linear part does not decay or the cost is not finite.
    """
    dynamics = fit_reduced_dynamics(training, order, ridge, known)
    samples = [modal_samples(dynamics, trajectory) for trajectory in training]
    q, q_dot = np.vstack([s[0] for s in samples]), np.vstack([s[1] for s in samples])
    table = resonance_table(dynamics.eigenvalues, order, internal_resonance)
    stride, step = _stride(len(q), FIT_SAMPLES), _stride(len(q), CHART_SAMPLES)
    conjugacy = grow_conjugacy(dynamics, (q[::stride], q_dot[::stride]), table, ridge)
    z = q + monomials(zeta(q), table.exponents) @ conjugacy.A.T
    chart = fit_chart(dynamics, q[::step], z[::step], table.exponents, ridge)
    w = 2.0 * (q @ dynamics.vectors.T).real
    return NormalFormFit(
        dynamics,
        table,
        conjugacy,
        PolynomialMap(table.exponents, conjugacy.B),
        chart,
        inverse_chart(dynamics, table.exponents, conjugacy.A),
        trained_range(z),
        relative_error_percent(w, evaluate(chart, zeta(z)).real),
    )


def with_replicates(
    fit: NormalFormFit, training: Sequence[ReducedTrajectory], ridge: float, *, keep_linear: bool = False
) -> NormalFormFit:
    """Return a fit with the replicates of its coefficients; one that has them, or was not fitted here, as it is.

    ``keep_linear`` says that the linear part was given and not fitted.
    """
    if fit.conjugacy is None or fit.replicates is not None:
        return fit
    ridges = ridge, graded_ridge(ridge, fit.resonance.exponents)
    stride = _stride(sum(len(r.t) for r in training), FIT_SAMPLES)
    pair = fit.conjugacy, fit.resonance.resonant
    options = stride, keep_linear
    return replace(fit, replicates=conjugacy_replicates(training, fit.dynamics, pair, ridges, options))


def _stride(n_sample: int, wanted: int) -> int:
    return max(1, n_sample // wanted)


def resonance_table(eigenvalues: ComplexArray, order: int, internal_resonance: Resonance) -> ResonanceTable:
    """Return the terms of degree 2..order to keep; "auto" finds the integers, "gap" a tolerance, () is none."""
    table = exponents(2 * len(eigenvalues), 2, order)
    if internal_resonance == "auto":
        return automatic_resonance(eigenvalues, table)
    if internal_resonance == "gap":
        return gap_resonance(eigenvalues, table)
    if internal_resonance == ():
        return trivial_resonance(eigenvalues, table)
    return integer_resonance(eigenvalues, table, internal_resonance)


def grow_conjugacy(
    dynamics: ReducedDynamics, samples: tuple[ComplexArray, ComplexArray], table: ResonanceTable, ridge: float
) -> ConjugacyFit:
    """Fit A and B at order 3, then 5, 7, .. from the last optimum.

    The homological start is good at low order only: its small denominators grow with the degree.
    """
    q = samples[0]
    degree = table.exponents.sum(axis=1)
    fit: ConjugacyFit | None = None
    for order in sorted({*range(3, int(degree.max()), 2), int(degree.max())}):
        n_term = int((degree <= order).sum())
        E, resonant = table.exponents[:n_term], table.resonant[:, :n_term]
        if fit is None:
            start = homological_start(modal_terms(dynamics, q, E, ridge), dynamics.eigenvalues, E, resonant)
        else:
            more = ((0, 0), (0, n_term - fit.A.shape[1]))
            start = np.pad(fit.A, more), np.pad(fit.B, more)
        fit = settle_conjugacy(samples, dynamics.eigenvalues, E, resonant, start, graded_ridge(ridge, E))
    if fit is None:
        raise NumericalError("the order leaves no nonlinear term", where="normal form", value=int(degree.max()))
    return fit


def graded_ridge(ridge: float, exponents: IntArray) -> FloatArray:
    """Return the ridge of each term, (n_term,): ridge up to degree 3, ridge 10^degree above."""
    degree = exponents.sum(axis=1)
    weights: FloatArray = ridge * np.where(degree > FREE_DEGREE, GRADE ** degree.astype(np.float64), 1.0)
    return weights


def modal_terms(dynamics: ReducedDynamics, q: ComplexArray, exponents: IntArray, ridge: float) -> ComplexArray:
    """Return g (m, n_term) of q' = Lambda q + g phi(q): the fitted vector field in modal coordinates."""
    w = 2.0 * (q @ dynamics.vectors.T).real
    rate = evaluate(dynamics.vector_field, w) @ dynamics.inverse.T
    return ridge_fit(monomials(zeta(q), exponents), rate - dynamics.eigenvalues * q, ridge)


def fit_chart(
    dynamics: ReducedDynamics, q: ComplexArray, z: ComplexArray, exponents: IntArray, ridge: float
) -> PolynomialMap[np.complex128]:
    """Return T of w = 2 Re(V (z + C phi(z))), C by regression of q - z along the samples."""
    C = ridge_fit(monomials(zeta(z), exponents), q - z, ridge)
    return chart_from(dynamics, exponents, C)


def chart_from(dynamics: ReducedDynamics, exponents: IntArray, C: ComplexArray) -> PolynomialMap[np.complex128]:
    """Return T = 2 V [I, 0, C] over (z, conj z, phi)."""
    m = len(C)
    linear = np.eye(2 * m, dtype=np.int64)
    rows = np.hstack([np.eye(m), np.zeros((m, m)), C]).astype(np.complex128)
    return PolynomialMap(np.vstack([linear, exponents]), 2.0 * dynamics.vectors @ rows)


def inverse_chart(dynamics: ReducedDynamics, exponents: IntArray, A: ComplexArray) -> PolynomialMap[np.complex128]:
    """Return H of z = q + A phi(q), q = (V^-1 w)_{1..m}, expanded in monomials of w."""
    m = len(A)
    near_identity = PolynomialMap(
        np.vstack([np.eye(2 * m, dtype=np.int64), exponents]),
        np.hstack([np.eye(m), np.zeros((m, m)), A]).astype(np.complex128),
    )
    return substitute_linear(near_identity, np.vstack([dynamics.inverse, dynamics.inverse.conj()]))


def relative_error_percent(w: FloatArray, fitted: FloatArray) -> float:
    """Return 100 mean abs(w - fitted) / max abs(w) over the samples (rows)."""
    largest = float(np.linalg.norm(w, axis=1).max())
    return 100.0 * float(np.linalg.norm(w - fitted, axis=1).mean()) / largest
