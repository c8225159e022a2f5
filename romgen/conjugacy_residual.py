"""The conjugacy residual, its derivative as products J v and J^H r, and the Gauss-Newton step by conjugate gradients.

Notation of ``conjugacy``; theta (m, n_term) holds B where a term is resonant in a row and A elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.polynomial import monomial_gradient, monomial_rate, monomials, zeta

# Conjugate gradients: relative residual in the norm of the preconditioner, and largest number of products.
CG_TOLERANCE, CG_STEPS = 1e-4, 60
# Relative shift of the diagonal that keeps the preconditioner positive definite in double precision.
SHIFT = 1e-12


@dataclass(frozen=True)
class ConjugacyProblem:
    """Samples and pattern; theta holds per row all terms: B where resonant, A elsewhere, (m, n_term) complex."""

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

    @cached_property
    def linear_gram(self) -> ComplexArray:
        """Gram matrices of phi' - lambda_j phi, (m, n_term, n_term): what r_j does with its own row of A."""
        grams = np.empty((len(self.eigenvalues), self.phi.shape[1], self.phi.shape[1]), dtype=np.complex128)
        for gram, eigenvalue in zip(grams, self.eigenvalues, strict=True):
            column = self.phi_dot - eigenvalue * self.phi
            gram[:] = column.conj().T @ column / self.samples
        return grams

    def split(self, theta: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return A and the kept columns of B."""
        return np.where(self.resonant, 0.0, theta), np.where(self.resonant, theta, 0.0)[:, self.kept]


@dataclass(frozen=True)
class LinearisedResidual:
    """Residual r (n, m) at theta and its derivative: monomials of z and slopes d(B phi(z))_j / d zeta_i, (n, m, 2m)."""

    problem: ConjugacyProblem
    r: ComplexArray
    phi_z: ComplexArray
    slopes: ComplexArray

    def forward(self, change: ComplexArray) -> ComplexArray:
        """Return dr = J change.

        r_j depends on A_l through z_l, so dr_j = dA_j phi' - lambda_j dz_j - dB_j phi(z) - sum_i slope_ji dzeta_i.
        """
        dA, dB = self.problem.split(change)
        dz = self.problem.phi @ dA.T
        through_z = np.einsum("tji,ti->tj", self.slopes, zeta(dz))
        dr: ComplexArray = self.problem.phi_dot @ dA.T - self.problem.eigenvalues * dz - self.phi_z @ dB.T - through_z
        return dr

    def adjoint(self, r: ComplexArray) -> ComplexArray:
        """Return g (m, n_term) over the number of residuals: Re g and Im g are the derivatives of sum abs(r)^2 / 2."""
        p, m = self.problem, r.shape[1]
        through_z = np.einsum("tji,tj->ti", self.slopes[:, :, :m].conj(), r)
        through_z += np.einsum("tji,tj->ti", self.slopes[:, :, m:], r.conj())
        g = (r.conj().T @ p.phi_dot - (r * p.eigenvalues.conj() + through_z).conj().T @ p.phi).conj()
        kept = np.zeros_like(g)
        kept[:, p.kept] = -(r.conj().T @ self.phi_z).conj()
        total: ComplexArray = np.where(p.resonant, kept, g) / p.samples
        return total

    def row_curvature(self, j: int) -> ComplexArray:
        """Return the Gram matrix (n_term, n_term) of dr_j / dtheta_j, phi(z) held."""
        p = self.problem
        H: ComplexArray = p.linear_gram[j].copy()
        own = p.resonant[j]
        columns = -self.phi_z[:, own[p.kept]]
        linear = p.phi_dot - p.eigenvalues[j] * p.phi
        cross = (columns.conj().T @ linear) / p.samples
        H[own] = cross
        H[:, own] = cross.conj().T
        H[np.ix_(own, own)] = (columns.conj().T @ columns) / p.samples
        return H


@dataclass(frozen=True)
class RowCurvature:
    """The curvature of all rows, ready to solve with any diagonal added."""

    curvature: ComplexArray

    @property
    def diagonal(self) -> FloatArray:
        """Mean square sensitivity of the residual to each coefficient, (m, n_term)."""
        diagonal: FloatArray = np.maximum(np.einsum("jkk->jk", self.curvature).real, np.finfo(float).tiny)
        return diagonal

    def damped(self, weight: FloatArray, damping: float) -> list[tuple[ComplexArray, bool]]:
        """Return Cholesky factors of H_j + diag(weight_j) + (damping + SHIFT) diag(H_j)."""
        more = weight + (damping + SHIFT) * self.diagonal
        return [cho_factor(H + np.diag(d), lower=True) for H, d in zip(self.curvature, more, strict=True)]


def linearise(problem: ConjugacyProblem, theta: ComplexArray) -> tuple[LinearisedResidual, RowCurvature]:
    """Return residual and derivative at theta (m, n_term), and the curvature of its rows."""
    A, B = problem.split(theta)
    z = problem.q + problem.phi @ A.T
    E, zz = problem.exponents[problem.kept], zeta(z)
    phi_z = monomials(zz, E)
    r = problem.q_dot + problem.phi_dot @ A.T - problem.eigenvalues * z - phi_z @ B.T
    slopes = np.stack([monomial_gradient(zz, E, i) @ B.T for i in range(zz.shape[1])], axis=-1)
    here = LinearisedResidual(problem, r, phi_z, slopes)
    return here, RowCurvature(np.array([here.row_curvature(j) for j in range(len(theta))]))


def residual(problem: ConjugacyProblem, theta: ComplexArray) -> ComplexArray:
    """Return r (n_time, m) at theta (m, n_term)."""
    A, B = problem.split(theta)
    z = problem.q + problem.phi @ A.T
    nonlinear = monomials(zeta(z), problem.exponents[problem.kept]) @ B.T
    r: ComplexArray = problem.q_dot + problem.phi_dot @ A.T - problem.eigenvalues * z - nonlinear
    return r


def solve_step(
    here: LinearisedResidual, rows: RowCurvature, right: ComplexArray, weight: FloatArray, damping: float
) -> ComplexArray:
    """Solve (J'J + diag(weight) + damping diag) x = right by preconditioned conjugate gradients."""
    factors = rows.damped(weight, damping)
    diagonal = weight + damping * rows.diagonal

    def precondition(v: ComplexArray) -> ComplexArray:
        return np.array([cho_solve(factor, row) for factor, row in zip(factors, v, strict=True)])

    x, misfit = np.zeros_like(right), right
    s = precondition(misfit)
    direction, size = s, float(np.vdot(misfit, s).real)
    first = size
    for _ in range(CG_STEPS):
        if not size > CG_TOLERANCE**2 * first:
            break
        product = here.adjoint(here.forward(direction)) + diagonal * direction
        step = size / float(np.vdot(direction, product).real)
        x, misfit = x + step * direction, misfit - step * product
        s = precondition(misfit)
        size, previous = float(np.vdot(misfit, s).real), size
        direction = s + size / previous * direction
    return x
