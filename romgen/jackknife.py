"""Uncertainty of a normal form by the delete-one-block jackknife over stretches of the training motions.

Residuals of a ring-down are correlated over many periods, and the misfit of a polynomial is not random at all, so the
covariance sigma^2 (J'J)^-1 of independent samples is far too small. Blocks of several beats are nearly independent.
With theta_b the coefficients without block b of G, the variance of a quantity g is

    var g = (G - 1) / G sum_b (g(theta_b) - mean_b g(theta_b))^2

(Quenouille, Tukey; blocks of dependent data: Kunsch 1989). Each theta_b is one Gauss-Newton step from the optimum.
Systematic errors that all blocks share (a wrong model, noise in the regressors) do not show in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.conjugacy import ConjugacyFit
from romgen.conjugacy_residual import SHIFT, ConjugacyProblem, linearise
from romgen.polynomial import monomials
from romgen.reduced_dynamics import ReducedDynamics, modal_samples
from romgen.regression import ridge_solve

# Blocks per trajectory: as in the cross-validation, several beats of two modes in each.
BLOCKS = 8


@dataclass(frozen=True)
class Replicates:
    """Coefficients without one block of the training data each.

    Attributes
    ----------
    eigenvalues : (n_block, m) Lambda, 1/s.
    normal_form : (n_block, m, n_term) N over the exponents of the fit, 1/s.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "block,mode"})
    normal_form: ComplexArray = field(metadata={"unit": "1/s", "axes": "block,mode,term"})


def jackknife_deviation(values: FloatArray | ComplexArray) -> FloatArray:
    """Return the standard deviation of a quantity from its replicates (n_block, ...); of abs for complex values."""
    n = len(values)
    spread: FloatArray = np.abs(values - values.mean(axis=0))
    return np.asarray(np.sqrt((n - 1) / n * np.sum(spread**2, axis=0)))


def effective_blocks(values: FloatArray) -> FloatArray:
    """Return the degrees of freedom of the jackknife variance of real replicates (n_block, ...), at least 2.

    nu = 3 (sum d^2)^2 / sum d^4 - 2, d the deviations from their mean, at most n_block - 1: Satterthwaite's
    (sum s_b^2)^2 / sum s_b^4 for normal d of unequal variance s_b^2. Few blocks of a decay have large amplitudes.
    """
    d = values - values.mean(axis=0)
    fourth = np.maximum(np.sum(d**4, axis=0), np.finfo(float).tiny)
    return np.asarray(np.clip(3.0 * np.sum(d**2, axis=0) ** 2 / fourth - 2.0, 2.0, len(values) - 1.0))


def conjugacy_replicates(
    training: Sequence[ReducedTrajectory],
    dynamics: ReducedDynamics,
    fit: tuple[ConjugacyFit, BoolArray],
    ridge: tuple[float, FloatArray],
    options: tuple[int, bool],
) -> Replicates:
    """Return the replicates of a direct fit.

    Lambda follows from the vector field refitted without the block, to first order; A and B from one step of each row
    of the conjugacy cost, phi(z) held.

    Parameters
    ----------
    fit : A and B; (m, n_term) True where a term belongs to B.
    ridge : of the vector field; of each term of the normal form (n_term,).
    options : stride of the samples that the conjugacy fit used; whether the linear part was given.
    """
    (stride, keep_linear), block = options, blocks_of(training)
    eigenvalues = np.tile(dynamics.eigenvalues, (block.max() + 1, 1))
    if not keep_linear:
        eigenvalues = _eigenvalues(training, dynamics, ridge[0], block)
    samples = [modal_samples(dynamics, r) for r in training]
    q, q_dot = (np.vstack([s[k] for s in samples])[::stride] for k in (0, 1))
    conjugacy, resonant = fit
    problem = ConjugacyProblem(q, q_dot, dynamics.eigenvalues, conjugacy.exponents, resonant)
    shift = eigenvalues - dynamics.eigenvalues
    rows = [_row_replicates(problem, conjugacy, j, (ridge[1], shift[:, j]), block[::stride]) for j in range(len(q.T))]
    return Replicates(eigenvalues, np.stack(rows, axis=1))


def blocks_of(training: Sequence[ReducedTrajectory]) -> IntArray:
    """Return the number of the block of every sample of the stacked trajectories, (n_sample,)."""
    own = [BLOCKS * k + np.arange(len(r.t)) * BLOCKS // len(r.t) for k, r in enumerate(training)]
    return np.concatenate(own)


def _eigenvalues(
    training: Sequence[ReducedTrajectory], dynamics: ReducedDynamics, ridge: float, block: IntArray
) -> ComplexArray:
    """Return Lambda without each block: d lambda_j = l_j dR v_j."""
    m = len(dynamics.eigenvalues)
    phi = monomials(np.vstack([r.y for r in training]) / dynamics.scale, dynamics.vector_field.exponents)
    rate = np.vstack([r.y_dot[:, m:] for r in training]) / dynamics.scale[m:]
    gram, cross = phi.T @ phi, phi.T @ rate
    full = ridge_solve(gram, cross, len(phi), ridge)
    values = []
    for b in range(block.max() + 1):
        out = block == b
        fewer = gram - phi[out].T @ phi[out], cross - phi[out].T @ rate[out]
        change = (ridge_solve(*fewer, int((~out).sum()), ridge) - full)[:, : 2 * m]
        values.append(
            dynamics.eigenvalues + np.einsum("ji,ik,kj->j", dynamics.inverse[:, m:], change, dynamics.vectors)
        )
    return np.array(values)


def _row_replicates(
    problem: ConjugacyProblem, conjugacy: ConjugacyFit, j: int, given: tuple[FloatArray, ComplexArray], block: IntArray
) -> ComplexArray:
    """Return row j of B without each block, (n_block, n_term); ``given`` are ridge and change of the eigenvalue."""
    ridge, shift = given
    theta = conjugacy.A + conjugacy.B
    here = linearise(problem, theta)[0]
    resonant = problem.resonant[j]
    X = problem.phi_dot - problem.eigenvalues[j] * problem.phi
    X[:, problem.kept[resonant[problem.kept]]] = -here.phi_z[:, resonant[problem.kept]]
    z = problem.q[:, j] + problem.phi @ conjugacy.A[j]
    H = X.conj().T @ X
    weight = (ridge + SHIFT) * np.diag(H).real
    rows = []
    for b in range(len(shift)):
        out, r = X[block == b], here.r[:, j] - shift[b] * z
        right = X.conj().T @ r - out.conj().T @ r[block == b] + weight * theta[j]
        factor = cho_factor(H - out.conj().T @ out + np.diag(weight), lower=True)
        rows.append(np.where(resonant, theta[j] - cho_solve(factor, right), 0.0))
    return np.array(rows)
