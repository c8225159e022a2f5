"""How the viscous force of Green-Lagrange bodies depends on the displacement: the part that completes full Newton."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import inlined, threaded
from fem.kernel import add_tangent, outer, push_forward, viscous_stress
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
            viscous_stress(F, D, lam, mu, S)
            push_forward(F, gradients[e, q], Fg)
            push_forward(D, gradients[e, q], Dg)
            push_forward(S, gradients[e, q], Sg)
            outer(F, D, FD)
            add_tangent(w, lam, mu, 1.0, gradients[e, q], Sg, Fg, Dg, FD, tangents[e])


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
