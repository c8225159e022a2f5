"""The observed displacement as a polynomial of the normal-form state, eliminated by variable projection.

Row j of the modal displacement eta is

    eta_j = Re(a_j z_j + sum_k C_jk zeta^E_k) + rest_j,

with a_j fixed, C over all terms that are not resonant with row j (which fixes the near-identity gauge), and one
constant ``rest`` per motion: friction leaves every ring-down at a rest position of its own, which a model with one
equilibrium cannot have and must not imitate by other terms. C and rest are linear, so they are eliminated
(Golub and Pereyra 1973; Gauss-Newton matrix of the projected problem after Kaufman 1975).

The penalty on C is the same for every term at the corner of the data, all modes at their largest amplitude at once:
a term that the data hardly excite, because its modes were never large together, stays small there.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.compiled import compiled_unlocked
from romgen.field_table import MonomialPlan, fill_monomials, monomial_plan, real_map
from romgen.polynomial import exponents, monomials, zeta
from romgen.resonance import ResonanceTable

# Relative to the largest diagonal entry of the scaled normal equations: far above rounding, far below any penalty.
JITTER = 1e-13


@dataclass(frozen=True)
class OutputMap:
    """Which terms make the displacement, and how large they may be.

    Attributes
    ----------
    linear : (m,) a, unit of eta.
    exponents : (n_term, 2m) degree >= 1, one of each conjugate pair.
    terms : (m, n_term) True where C is free.
    """

    linear: ComplexArray = field(metadata={"unit": "unit of eta", "axes": "mode"})
    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    terms: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})


@dataclass(frozen=True)
class ProjectedRow:
    """One row of the displacement after elimination of its linear unknowns.

    Attributes
    ----------
    C : (n_term,) complex, 0 where fixed; rest : (n_motion,) unit of eta.
    residual : (n_sample,) weighted data minus map.
    penalty : of C.
    basis : columns of all rows (shared); own : those of this row; scale, factor : Cholesky factor of their scaled
        normal equations.
    """

    C: ComplexArray = field(metadata={"unit": "unit of eta", "axes": "term"})
    rest: FloatArray = field(metadata={"unit": "unit of eta", "axes": "motion"})
    residual: FloatArray = field(metadata={"unit": "1", "axes": "sample"})
    penalty: float
    basis: FloatArray = field(metadata={"unit": "1", "axes": "sample,unknown"})
    own: IntArray = field(metadata={"unit": "1", "axes": "unknown"})
    scale: FloatArray = field(metadata={"unit": "mixed", "axes": "unknown"})
    factor: FloatArray = field(metadata={"unit": "1", "axes": "unknown,unknown"})

    def reduced(self, J: FloatArray) -> FloatArray:
        """Return J'J - J'M (M'M + R)^-1 M'J: the curvature that is left when C and rest follow."""
        cross = (self.basis.T @ J)[self.own] / self.scale[:, None]
        curvature: FloatArray = J.T @ J - cross.T @ cho_solve((self.factor, True), cross)
        return curvature


def output_map(linear: ComplexArray, table: ResonanceTable) -> OutputMap:
    """Return the map whose degree is that of the resonance table, with all its non-resonant terms.

    Parameters
    ----------
    linear : (m,) a.
    """
    m = len(linear)
    E = exponents(2 * m, 1, int(table.exponents.sum(axis=1).max()))
    swapped = np.hstack([E[:, m:], E[:, :m]])
    # of each conjugate pair the first in the graded table stays
    number = {tuple(row): k for k, row in enumerate(E.tolist())}
    partner = np.array([number[tuple(row)] for row in swapped.tolist()])
    resonant = np.hstack([np.eye(m, 2 * m, dtype=bool), table.resonant])
    fixed = resonant | resonant[:, partner]
    first = np.arange(len(E)) <= partner
    return OutputMap(linear, E[first], ~fixed[:, first])


def project(
    output: OutputMap, z: ComplexArray, data: tuple[FloatArray, FloatArray, IntArray], corner: FloatArray
) -> list[ProjectedRow]:
    """Return the C and rest of every row that fit the data best.

    Parameters
    ----------
    z : (n_sample, m).
    data : displacement (n_sample, m), weight (n_sample,), and number of the motion of each sample (n_sample,).
    corner : (n_term,) penalty: adds corner^2 abs(C)^2 to the sum of squares; linear terms are free.
    """
    eta, share, motion = data
    m, n_motion = z.shape[1], int(motion.max()) + 1
    # the imaginary part of a product z_i conj z_i .. is 0
    turning = np.flatnonzero((output.exponents[:, :m] != output.exponents[:, m:]).any(axis=1))
    M = _design(zeta(z), (share, motion), monomial_plan(output.exponents), turning, n_motion)
    normal = M.T @ M
    rows = []
    for j in range(m):
        free = np.concatenate([output.terms[j], output.terms[j][turning], np.ones(n_motion, dtype=bool)])
        penalised = np.where(output.exponents.sum(axis=1) > 1, corner**2, 0.0)
        weights = np.concatenate([penalised, penalised[turning], np.zeros(n_motion)])
        target = share * (eta[:, j] - (output.linear[j] * z[:, j]).real)
        c, own, scale, factor = _solved(normal, M.T @ target, weights, np.flatnonzero(free))
        n = len(output.exponents)
        C = c[:n].astype(np.complex128)
        C[turning] += 1j * c[n : n + len(turning)]
        rest = c[n + len(turning) :]
        rows.append(ProjectedRow(C, rest, target - M @ c, float(weights @ c**2), M, own, scale, factor))
    return rows


def _solved(
    normal: FloatArray, right: FloatArray, weights: FloatArray, own: IntArray
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    """Return c with (M'M + diag(weights)) c = right over the columns ``own``, 0 elsewhere, with its factor."""
    H = normal[np.ix_(own, own)] + np.diag(weights[own])
    scale = np.sqrt(np.maximum(np.diag(H), np.finfo(float).tiny))
    H = H / np.outer(scale, scale) + JITTER * np.eye(len(scale))
    factor = cho_factor(H, lower=True)[0]
    c = np.zeros(len(right))
    c[own] = cho_solve((factor, True), right[own] / scale) / scale
    return c, own, scale, factor


@compiled_unlocked
def _design(
    zeta: ComplexArray,
    samples: tuple[FloatArray, IntArray],
    plan: MonomialPlan,
    turning: IntArray,
    n_motion: int,
) -> FloatArray:
    """Return share times (Re phi, -Im phi of the turning terms, 1 of the own motion), (n_sample, n_unknown)."""
    share, motion = samples
    n_term, n_turning = plan.term.size, turning.size
    M = np.zeros((len(zeta), n_term + n_turning + n_motion))
    phi = np.empty(plan.parent.size, dtype=np.complex128)
    for k in range(len(zeta)):
        fill_monomials(zeta[k], plan.parent, plan.variable, phi)
        for q in range(n_term):
            M[k, q] = share[k] * phi[plan.term[q]].real
        for q in range(n_turning):
            M[k, n_term + q] = -share[k] * phi[plan.term[turning[q]]].imag
        M[k, n_term + n_turning + motion[k]] = share[k]
    return M


def displacement(output: OutputMap, C: ComplexArray, z: ComplexArray) -> FloatArray:
    """Return eta (n_sample, m) without rest, for C (m, n_term) and z (n_sample, m)."""
    eta: FloatArray = (output.linear * z + monomials(zeta(z), output.exponents) @ C.T).real
    return eta


def slopes(output: OutputMap, C: ComplexArray, z: ComplexArray) -> ComplexArray:
    """Return s (n_sample, m, m) with d eta_j = Re(sum_i s_ji dz_i), the conjugate part folded in."""
    s: ComplexArray = real_map(output.exponents, C, z)[1] + np.diag(output.linear)
    return s
