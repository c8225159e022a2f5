"""Least-squares normal form: the change of coordinates and the dynamics that make each other consistent.

With q the modal coordinates of the linear part, z = q + A phi(q), n(z) = Lambda z + B phi(z), phi all monomials of
(q, conj q) of degree 2..f, the conjugacy residual of row j at a sample is

    r_j = q_j' + A_j phi'(q) - lambda_j (q_j + A_j phi(q)) - B_j phi(q + A phi(q)).

Near-resonant terms belong to B, all others to A, so that both are determined. The cost is the mean of abs(r_j)^2 over
rows and samples plus ridge sum_k d_k^2 abs(theta_k)^2, d_k^2 the mean square of the residual's sensitivity to theta_k
at the start (so the ridge has no unit).

Levenberg-Marquardt with the exact Jacobian; its normal equations are never formed. Conjugate gradients solve them
with products J v and J^H r, preconditioned by the equations of the rows alone: row j depends on the other rows of A,
and on its own A inside phi(z), through the small slopes of B phi(z) only.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.conjugacy_residual import (
    ConjugacyProblem,
    LinearisedResidual,
    RowCurvature,
    linearise,
    residual,
    solve_step,
)
from romgen.errors import NumericalError
from romgen.polynomial import zeta

MAX_STEPS = 60
# Relative decrease of the cost below which Levenberg-Marquardt has converged, or has settled: what is left then lies in
# directions that the samples hardly determine, and in many unknowns takes more time than all steps before.
DECREASE, SETTLED = 1e-5, 1e-3
MAX_REJECTIONS = 25


@dataclass(frozen=True)
class ConjugacyFit:
    """Optimal A and B with the history of the cost and the uncertainty of the coefficients.

    Attributes
    ----------
    exponents : (n_term, 2m) degree 2..f over (q, conj q).
    A, B : (m, n_term) complex, zero where a term belongs to the other; q has unit 1, so A is 1 and B is 1/s.
    cost : mean of abs(r)^2 over rows and samples, 1/s^2.
    costs : cost with ridge after each accepted step, the start first.
    A_deviation, B_deviation : (m, n_term) standard deviation of A, B as complex numbers, from the residual variance
        and the curvature of each row alone; samples count as independent.
    """

    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    A: ComplexArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode,term"})
    cost: float
    costs: FloatArray = field(metadata={"unit": "1/s^2", "axes": "step"})
    A_deviation: FloatArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B_deviation: FloatArray = field(metadata={"unit": "1/s", "axes": "mode,term"})


def homological_start(
    g: ComplexArray, eigenvalues: ComplexArray, exponents: IntArray, resonant: BoolArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return A and B that remove the terms g of q' = Lambda q + g phi(q) to first order.

    A_jk = g_jk / (lambda_j - <m_k, lambda>) on non-resonant, B_jk = g_jk on resonant terms.

    Parameters
    ----------
    g, resonant : (m, n_term).
    """
    detuning = eigenvalues[:, None] - exponents @ zeta(eigenvalues)
    B = np.where(resonant, g, 0.0).astype(np.complex128)
    A = np.where(resonant, 0.0, g).astype(np.complex128) / np.where(resonant, 1.0, detuning)
    return A, B


def fit_conjugacy(
    samples: tuple[ComplexArray, ComplexArray],
    eigenvalues: ComplexArray,
    exponents: IntArray,
    resonant: BoolArray,
    start: tuple[ComplexArray, ComplexArray],
    ridge: float | FloatArray,
) -> ConjugacyFit:
    """Minimise the conjugacy cost by Levenberg-Marquardt with the exact Jacobian, to convergence.

    Parameters
    ----------
    samples : q and q', each (n_time, m), all training trajectories stacked.
    eigenvalues : (m,) 1/s, kept.
    exponents : (n_term, 2m); resonant : (m, n_term) True where a term belongs to B.
    start : A, B.
    ridge : weight of the coefficients, no unit; one number or one per term (n_term,).

    Raises
    ------
    NumericalError : the cost is not finite at the start.
    """
    return _fit(ConjugacyProblem(*samples, eigenvalues, exponents, resonant), start, ridge, DECREASE)


def settle_conjugacy(
    samples: tuple[ComplexArray, ComplexArray],
    eigenvalues: ComplexArray,
    exponents: IntArray,
    resonant: BoolArray,
    start: tuple[ComplexArray, ComplexArray],
    ridge: float | FloatArray,
) -> ConjugacyFit:
    """Minimise as ``fit_conjugacy`` until a step lowers the cost by less than a thousandth."""
    return _fit(ConjugacyProblem(*samples, eigenvalues, exponents, resonant), start, ridge, SETTLED)


def _fit(
    problem: ConjugacyProblem, start: tuple[ComplexArray, ComplexArray], ridge: float | FloatArray, decrease: float
) -> ConjugacyFit:
    resonant = problem.resonant
    theta = np.where(resonant, start[1], start[0]).astype(np.complex128)
    here, rows = linearise(problem, theta)
    weight = ridge * rows.diagonal
    total, damping = _cost(here.r) + _penalty(weight, theta), 1e-6
    if not np.isfinite(total):
        raise NumericalError("the conjugacy cost is not finite", where="normal form", value=total)
    costs = [total]
    for _ in range(MAX_STEPS):
        found = _accepted_step(here, rows, theta, weight, damping)
        if found is None:
            break
        theta, total, damping = found
        here, rows = linearise(problem, theta)
        costs.append(total)
        if costs[-2] - costs[-1] <= decrease * costs[-2]:
            break
    cost = _cost(here.r)
    deviation = _deviations(rows, weight, cost / problem.samples)
    zero = np.zeros_like(theta)
    A, B = np.where(resonant, zero, theta), np.where(resonant, theta, zero)
    spread = np.where(resonant, 0.0, deviation), np.where(resonant, deviation, 0.0)
    return ConjugacyFit(problem.exponents, A, B, cost, np.array(costs), *spread)


def _cost(r: ComplexArray) -> float:
    return float(np.mean(np.abs(r) ** 2))


def _penalty(weight: FloatArray, theta: ComplexArray) -> float:
    return float(np.sum(weight * np.abs(theta) ** 2))


def _accepted_step(
    here: LinearisedResidual, rows: RowCurvature, theta: ComplexArray, weight: FloatArray, damping: float
) -> tuple[ComplexArray, float, float] | None:
    """Return theta, its cost and the next damping of the first step that lowers the cost; None at the optimum."""
    slope = here.adjoint(here.r) + weight * theta
    total = _cost(here.r) + _penalty(weight, theta)
    for _ in range(MAX_REJECTIONS):
        trial = theta + solve_step(here, rows, -slope, weight, damping)
        value = _cost(residual(here.problem, trial)) + _penalty(weight, trial)
        if value < total:
            return trial, value, max(damping / 10.0, 1e-12)
        damping *= 10.0
    return None


def _deviations(rows: RowCurvature, weight: FloatArray, variance: float) -> FloatArray:
    """Return standard deviations (m, n_term): covariance = variance * curvature^-1 (Gauss-Newton, row by row)."""
    inverses = [np.linalg.pinv(H + np.diag(w), hermitian=True) for H, w in zip(rows.curvature, weight, strict=True)]
    deviations: FloatArray = np.sqrt(variance * np.maximum([np.diag(inverse).real for inverse in inverses], 0.0))
    return deviations
