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
from romgen.polynomial import exponents, monomial_gradient, monomials, zeta
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
    """

    C: ComplexArray = field(metadata={"unit": "unit of eta", "axes": "term"})
    rest: FloatArray = field(metadata={"unit": "unit of eta", "axes": "motion"})
    residual: FloatArray = field(metadata={"unit": "1", "axes": "sample"})
    penalty: float
    basis: FloatArray = field(metadata={"unit": "1", "axes": "sample,unknown"})
    scale: FloatArray = field(metadata={"unit": "mixed", "axes": "unknown"})
    factor: FloatArray = field(metadata={"unit": "1", "axes": "unknown,unknown"})

    def reduced(self, J: FloatArray) -> FloatArray:
        """Return J'J - J'M (M'M + R)^-1 M'J: the curvature that is left when C and rest follow."""
        cross = (self.basis.T @ J) / self.scale[:, None]
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
    output: OutputMap,
    z: ComplexArray,
    data: tuple[FloatArray, FloatArray, IntArray],
    corner: FloatArray,
    j: int,
) -> ProjectedRow:
    """Return the C and rest of row j that fit the data best.

    Parameters
    ----------
    z : (n_sample, m).
    data : displacement of row j, weight, and number of the motion of each sample, (n_sample,) each.
    corner : (n_term,) penalty: adds corner^2 abs(C)^2 to the sum of squares; linear terms are free.
    """
    x, share, motion = data
    E = output.exponents[output.terms[j]]
    m = z.shape[1]
    own = (E[:, :m] == E[:, m:]).all(axis=1)
    phi = monomials(zeta(z), E)
    constants = (motion[:, None] == np.arange(motion.max() + 1)).astype(np.float64)
    M = share[:, None] * np.hstack([phi.real, -phi.imag[:, ~own], constants])
    weight = np.where(E.sum(axis=1) > 1, corner[output.terms[j]] ** 2, 0.0)
    weights = np.concatenate([weight, weight[~own], np.zeros(constants.shape[1])])
    normal = M.T @ M + np.diag(weights)
    scale = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    normal = normal / np.outer(scale, scale) + JITTER * np.eye(len(scale))
    factor = cho_factor(normal, lower=True)[0]
    target = share * (x - (output.linear[j] * z[:, j]).real)
    c = cho_solve((factor, True), M.T @ target / scale) / scale
    C = np.zeros(len(output.exponents), dtype=np.complex128)
    values = c[: len(E)].astype(np.complex128)
    values[~own] += 1j * c[len(E) : len(c) - constants.shape[1]]
    C[output.terms[j]] = values
    rest = c[len(c) - constants.shape[1] :]
    return ProjectedRow(C, rest, target - M @ c, float(weights @ c**2), M, scale, factor)


def displacement(output: OutputMap, C: ComplexArray, z: ComplexArray) -> FloatArray:
    """Return eta (n_sample, m) without rest, for C (m, n_term) and z (n_sample, m)."""
    eta: FloatArray = (output.linear * z + monomials(zeta(z), output.exponents) @ C.T).real
    return eta


def slopes(output: OutputMap, C: ComplexArray, z: ComplexArray) -> ComplexArray:
    """Return s (n_sample, m, m) with d eta_j = Re(sum_i s_ji dz_i), the conjugate part folded in."""
    m = z.shape[1]
    zz = zeta(z)
    parts = [monomial_gradient(zz, output.exponents, i) @ C.T for i in range(2 * m)]
    folded = np.stack([parts[i] + parts[m + i].conj() for i in range(m)], axis=-1)
    total: ComplexArray = folded + np.diag(output.linear)
    return total
