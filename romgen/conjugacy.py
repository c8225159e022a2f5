"""Least-squares normal form: the change of coordinates and the dynamics that make each other consistent.

With q the modal coordinates of the linear part, z = q + A phi(q), n(z) = Lambda z + B phi(z), phi all monomials of
(q, conj q) of degree 2..f, the conjugacy residual of row j at a sample is

    r_j = q_j' + A_j phi'(q) - lambda_j (q_j + A_j phi(q)) - B_j phi(q + A phi(q)).

Near-resonant terms belong to B, all others to A, so that both are determined. The cost is the mean of abs(r_j)^2 over
rows and samples plus ridge sum_k d_k^2 abs(theta_k)^2, d_k^2 the mean square of the residual's sensitivity to theta_k
at the start (so the ridge has no unit).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.errors import NumericalError
from romgen.polynomial import monomial_gradient, monomial_rate, monomials, zeta

CHUNK = 2048
MAX_STEPS = 15
# Relative decrease of the cost below which Levenberg-Marquardt has converged.
DECREASE = 1e-6
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
    A_deviation, B_deviation : (m, n_term) standard deviation of abs(A), abs(B) from residual variance and curvature.
    """

    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    A: ComplexArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode,term"})
    cost: float
    costs: FloatArray = field(metadata={"unit": "1/s^2", "axes": "step"})
    A_deviation: FloatArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B_deviation: FloatArray = field(metadata={"unit": "1/s", "axes": "mode,term"})


@dataclass(frozen=True)
class _Problem:
    q: ComplexArray
    q_dot: ComplexArray
    eigenvalues: ComplexArray
    exponents: IntArray
    resonant: BoolArray

    @property
    def samples(self) -> int:
        """Number of residuals."""
        return int(self.q.size)

    @cached_property
    def kept(self) -> IntArray:
        """Terms that are resonant in at least one row; the others never enter n."""
        return np.flatnonzero(self.resonant.any(axis=0))

    @cached_property
    def phi(self) -> ComplexArray:
        """Monomials of q."""
        return monomials(zeta(self.q), self.exponents)

    @cached_property
    def phi_dot(self) -> ComplexArray:
        """Time derivatives of the monomials of q."""
        return monomial_rate(zeta(self.q), zeta(self.q_dot), self.exponents)


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
    ridge: float,
) -> ConjugacyFit:
    """Minimise the conjugacy cost by Levenberg-Marquardt with the exact Jacobian.

    Parameters
    ----------
    samples : q and q', each (n_time, m), all training trajectories stacked.
    eigenvalues : (m,) 1/s, kept.
    exponents : (n_term, 2m); resonant : (m, n_term) True where a term belongs to B.
    start : A, B.
    ridge : weight of the coefficients, no unit.

    Raises
    ------
    NumericalError : the cost is not finite at the start.
    """
    problem = _Problem(samples[0], samples[1], eigenvalues, exponents, resonant)
    theta = _pack(start[0], start[1], resonant)
    curvature, gradient, cost = _normal_equations(problem, theta)
    if not np.isfinite(cost):
        raise NumericalError("the conjugacy cost is not finite", where="normal form", value=cost)
    weight = ridge * np.maximum(np.diag(curvature), np.finfo(float).tiny)
    total, damping = cost + float(weight @ theta**2), 1e-6
    costs = [total]
    for _ in range(MAX_STEPS):
        found = _accepted_step(problem, theta, (curvature, gradient, total), weight, damping)
        if found is None:
            break
        theta, total, damping = found
        curvature, gradient, cost = _normal_equations(problem, theta)
        costs.append(total)
        if costs[-2] - costs[-1] <= DECREASE * costs[-2]:
            break
    A, B = _unpack(theta, problem)
    deviation = _deviations(curvature + np.diag(weight), cost, problem)
    return ConjugacyFit(exponents, A, B, cost, np.array(costs), *deviation)


def _accepted_step(
    problem: _Problem,
    theta: FloatArray,
    quadratic: tuple[FloatArray, FloatArray, float],
    weight: FloatArray,
    damping: float,
) -> tuple[FloatArray, float, float] | None:
    """Return theta, its cost and the next damping of the first step that lowers the cost; None at the optimum."""
    curvature, gradient, total = quadratic
    hessian, slope = curvature + np.diag(weight), gradient + weight * theta
    for _ in range(MAX_REJECTIONS):
        damped = hessian + np.diag(damping * np.diag(hessian))
        trial = theta - np.linalg.solve(damped, slope)
        value = _cost(problem, trial) + float(weight @ trial**2)
        if value < total:
            return trial, value, max(damping / 10.0, 1e-12)
        damping *= 10.0
    return None


def _pack(A: ComplexArray, B: ComplexArray, resonant: BoolArray) -> FloatArray:
    c = np.concatenate([A[~resonant], B[resonant]])
    return np.concatenate([c.real, c.imag])


def _unpack(theta: FloatArray, problem: _Problem) -> tuple[ComplexArray, ComplexArray]:
    half = len(theta) // 2
    c = theta[:half] + 1j * theta[half:]
    A, B = np.zeros(problem.resonant.shape, dtype=complex), np.zeros(problem.resonant.shape, dtype=complex)
    n_A = int((~problem.resonant).sum())
    A[~problem.resonant], B[problem.resonant] = c[:n_A], c[n_A:]
    return A, B


def _chunks(problem: _Problem) -> Iterator[tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]]:
    """Yield q, q', phi(q), phi'(q) in blocks of rows."""
    for first in range(0, len(problem.q), CHUNK):
        rows = slice(first, first + CHUNK)
        yield problem.q[rows], problem.q_dot[rows], problem.phi[rows], problem.phi_dot[rows]


def _cost(problem: _Problem, theta: FloatArray) -> float:
    A, B = _unpack(theta, problem)
    total = 0.0
    for q, q_dot, phi, phi_dot in _chunks(problem):
        z = q + phi @ A.T
        nonlinear = monomials(zeta(z), problem.exponents[problem.kept]) @ B[:, problem.kept].T
        r = q_dot + phi_dot @ A.T - problem.eigenvalues * z - nonlinear
        total += float(np.sum(np.abs(r) ** 2))
    return total / problem.samples


def _normal_equations(problem: _Problem, theta: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return J'J, J'r and r'r over the number of residuals, J with respect to (Re theta, Im theta)."""
    curvature, gradient, cost = np.zeros((theta.size, theta.size)), np.zeros(theta.size), 0.0
    for chunk in _chunks(problem):
        for r, J in _rows(problem, theta, chunk):
            stacked = np.vstack([J.real, J.imag])
            residual = np.concatenate([r.real, r.imag])
            curvature += stacked.T @ stacked
            gradient += stacked.T @ residual
            cost += float(residual @ residual)
    return curvature / problem.samples, gradient / problem.samples, cost / problem.samples


def _rows(
    problem: _Problem, theta: FloatArray, chunk: tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]
) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Yield the residual of each row and its derivative to (Re theta, Im theta), (n, 2 n_unknown) complex.

    r_j depends on A_l through z_l, so dr_j/dA_l = delta_jl (phi' - lambda_j phi) - dn_j/dz_l phi and
    dr_j/dconj(A_l) = -dn_j/dconj(z_l) conj(phi); n is the nonlinear part B phi.
    """
    A, B = _unpack(theta, problem)
    q, q_dot, phi, phi_dot = chunk
    m = q.shape[1]
    zz = zeta(q + phi @ A.T)
    E, B_kept = problem.exponents[problem.kept], B[:, problem.kept]
    phi_z = monomials(zz, E)
    slopes = np.stack([monomial_gradient(zz, E, i) @ B_kept.T for i in range(2 * m)])
    in_A = [np.flatnonzero(~problem.resonant[j]) for j in range(m)]
    in_B = [np.flatnonzero(problem.resonant[j, problem.kept]) for j in range(m)]
    for j in range(m):
        r = q_dot[:, j] + phi_dot @ A[j] - problem.eigenvalues[j] * zz[:, j] - phi_z @ B_kept[j]
        plain, conjugate = [], []
        for i in range(m):
            plain.append(-slopes[i, :, j, None] * phi[:, in_A[i]])
            conjugate.append(-slopes[m + i, :, j, None] * phi[:, in_A[i]].conj())
        plain[j] += phi_dot[:, in_A[j]] - problem.eigenvalues[j] * phi[:, in_A[j]]
        for i in range(m):
            block = -phi_z[:, in_B[i]] if i == j else np.zeros((len(q), len(in_B[i])), dtype=complex)
            plain.append(block)
            conjugate.append(np.zeros_like(block))
        P, Q = np.hstack(plain), np.hstack(conjugate)
        yield r, np.hstack([P + Q, 1j * (P - Q)])


def _deviations(hessian: FloatArray, cost: float, problem: _Problem) -> tuple[FloatArray, FloatArray]:
    """Return standard deviations of abs(A), abs(B): covariance = cost / samples * hessian^-1 (Gauss-Newton)."""
    variance = np.diag(np.linalg.pinv(hessian, hermitian=True)) * cost / problem.samples
    A, B = _unpack(np.abs(variance), problem)
    return np.sqrt(A.real + A.imag), np.sqrt(B.real + B.imag)
