"""The sums of a step equation in one pass over memory each: array expressions read and write it twenty times."""

from __future__ import annotations

import numpy as np
from numba import prange

from fem.arrays import FloatArray
from fem.compiled import threaded
from fem.row_chunks import CHUNKS

Fields = tuple[FloatArray, ...]
Weights = tuple[float, ...]


def displaced(start: Fields, a: FloatArray, shares: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """u0 + s_u a and v0 + s_v a, (n_dof, n_case) each."""
    u, v = np.empty_like(a), np.empty_like(a)
    _displaced(start, a, shares, u, v)
    return u, v


def balanced(
    at: Fields, given: Fields, weights: Weights, force: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C a and the residual (n_dof, n_case) N, and the energy (n_case,) J of the linear bodies, u'(K u)/2.

    With k = K u0 + s K a, d = alpha M a + beta K a and f = force + k + contact, which replaces ``force``:

        r = (w_i (M a + M_c a) + constant + w_f (w_d d + f + viscous)) where nothing is held, 0 elsewhere.

    Parameters
    ----------
    at : u, M a, K a, M_c a of the dispersion correction, contact and viscous forces, (n_dof, n_case).
    given : constant, K u0 (n_dof, n_case) and the mask (n_dof, 1), 0 where a support holds.
    weights : (6,) s, alpha, beta, w_i, w_f, w_d.
    force : (n_dof, n_case) N of the Green-Lagrange bodies.
    """
    damping, residual = np.empty_like(force), np.empty_like(force)
    energy = np.empty((CHUNKS, force.shape[1]))
    _balanced(at, given, weights, force, (damping, residual, energy))
    return damping, residual, np.asarray(energy.sum(axis=0))


@threaded
def _displaced(start: Fields, a: FloatArray, shares: tuple[float, float], u: FloatArray, v: FloatArray) -> None:
    u0, v0 = start
    for i in prange(a.shape[0]):
        for c in range(a.shape[1]):
            u[i, c] = u0[i, c] + shares[0] * a[i, c]
            v[i, c] = v0[i, c] + shares[1] * a[i, c]


@threaded
def _balanced(at: Fields, given: Fields, weights: Weights, force: FloatArray, out: Fields) -> None:
    """Energies are summed within a fixed number of chunks, so that they do not depend on the number of threads."""
    u, inertia, stiffness, correction, contact, viscous = at
    constant, linear, mask = given
    damping, residual, energy = out
    n, n_case = force.shape
    s, alpha, beta, of_inertia, of_force, of_damping = weights
    for chunk in prange(len(energy)):
        energy[chunk] = 0.0
        for i in range(chunk * n // len(energy), (chunk + 1) * n // len(energy)):
            for c in range(n_case):
                k = linear[i, c] + s * stiffness[i, c]
                d = alpha * inertia[i, c] + beta * stiffness[i, c]
                f = force[i, c] + k + contact[i, c]
                r = of_inertia * (inertia[i, c] + correction[i, c]) + constant[i, c]
                energy[chunk, c] += 0.5 * u[i, c] * k
                force[i, c] = f
                damping[i, c] = d
                residual[i, c] = mask[i, 0] * (r + of_force * (of_damping * d + f + viscous[i, c]))
