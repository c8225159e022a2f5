"""How the viscous force of Green-Lagrange bodies depends on the displacement: the part that completes full Newton."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import inlined, threaded
from fem.model import Model


@threaded
def viscous_tangents(
    gradients: FloatArray,
    weights: FloatArray,
    cells: IntArray,
    lame: FloatArray,
    u: FloatArray,
    v: FloatArray,
    tangents: FloatArray,
) -> None:
    """d/du of sum_q w F S_v grad N_a at fixed v with S_v = C:sym(F' D), D = grad v, for beta = 1 s.

    K_ab = sum_q w [(g_a.S_v g_b) I + lambda F g_a (D g_b)' + mu F g_b (D g_a)' + mu (g_a.g_b) F D'].

    u, v (n_dof,) m and m/s; tangents (n_cell, n_local, n_local, 3, 3) N s/m per s, overwritten; the rest as in
    ``kernel.element_forces``.

    Source: linearisation of the viscous stress of ``kernel.element_forces``.
    """
    n_cell, n_point, _, n_local = gradients.shape
    for e in prange(n_cell):
        F, D, S, FD = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        Fg, Dg, Sg = np.empty((n_local, 3)), np.empty((n_local, 3)), np.empty((n_local, 3))
        lam, mu = lame[e, 0], lame[e, 1]
        tangents[e] = 0.0
        for q in range(n_point):
            w = weights[e, q]
            _fields(u, v, cells[e], gradients[e, q], F, D)
            _stress(F, D, lam, mu, S, FD)
            for i in range(3):
                for a in range(n_local):
                    g0, g1, g2 = gradients[e, q, 0, a], gradients[e, q, 1, a], gradients[e, q, 2, a]
                    Fg[a, i] = F[i, 0] * g0 + F[i, 1] * g1 + F[i, 2] * g2
                    Dg[a, i] = D[i, 0] * g0 + D[i, 1] * g1 + D[i, 2] * g2
                    Sg[a, i] = S[i, 0] * g0 + S[i, 1] * g1 + S[i, 2] * g2
            for a in range(n_local):
                for b in range(n_local):
                    geometric = 0.0
                    product = 0.0
                    for i in range(3):
                        geometric += gradients[e, q, i, b] * Sg[a, i]
                        product += gradients[e, q, i, a] * gradients[e, q, i, b]
                    for i in range(3):
                        tangents[e, a, b, i, i] += w * geometric
                        for j in range(3):
                            tangents[e, a, b, i, j] += w * (
                                lam * Fg[a, i] * Dg[b, j] + mu * Fg[b, i] * Dg[a, j] + mu * product * FD[i, j]
                            )


@inlined
def _fields(u: FloatArray, v: FloatArray, nodes: IntArray, gradients: FloatArray, F: FloatArray, D: FloatArray) -> None:
    """F = I + grad u and D = grad v of one cell at one point."""
    for i in range(3):
        for j in range(3):
            s, t = 0.0, 0.0
            for a in range(len(nodes)):
                s += u[3 * nodes[a] + i] * gradients[j, a]
                t += v[3 * nodes[a] + i] * gradients[j, a]
            F[i, j], D[i, j] = s, t
        F[i, i] += 1.0


@inlined
def _stress(F: FloatArray, D: FloatArray, lam: float, mu: float, S: FloatArray, FD: FloatArray) -> None:
    """S <- lam tr(E') I + 2 mu E' with E' = sym(F'D), and FD <- F D'."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            s, t = 0.0, 0.0
            for k in range(3):
                s += F[k, i] * D[k, j] + D[k, i] * F[k, j]
                t += F[i, k] * D[j, k]
            S[i, j], FD[i, j] = mu * s, t
        trace += S[i, i] / (2.0 * mu)
    for i in range(3):
        S[i, i] += lam * trace


def viscous_stiffness(model: Model, u: FloatArray, v: FloatArray, beta: float) -> sp.csr_matrix:
    """d f_viscous / d u at u, v (n_dof,), unsymmetric, (n_dof, n_dof) N/m; beta in s."""
    total = sp.csr_matrix((model.n_dof, model.n_dof))
    if beta == 0.0:
        return total
    for cells in model.nonlinear:
        n_cell, n_local = cells.nodes.shape
        tangents = np.empty((n_cell, n_local, n_local, 3, 3))
        viscous_tangents(cells.gradients, cells.weights, cells.nodes, cells.lame, u, v, tangents)
        total = total + beta * cells.assemble(tangents)
    return total.tocsr()
