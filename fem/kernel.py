"""Compiled Total Lagrangian kernels: internal force, tangent and mass for any solid element.

Shape gradients with respect to the undeformed coordinates and integration weights come in as arrays, so that one kernel
serves all element types. St. Venant-Kirchhoff: S = S_0 + lambda tr(E) I + 2 mu E, E = (F'F - I)/2, P = F S.
Several load cases (trajectories) march together: fields are (n_dof, n_case), degree of freedom 3 node + component.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import compiled, inlined, threaded


@threaded
def element_forces(
    gradients: FloatArray,
    weights: FloatArray,
    cells: IntArray,
    lame: FloatArray,
    initial: FloatArray,
    u: FloatArray,
    v: FloatArray,
    beta: float,
    forces: FloatArray,
    viscous: FloatArray,
    energies: FloatArray,
) -> None:
    """f_a = sum_q w F S grad N_a, the same with S_v = beta C:E' and the strain energy sum_q w S:E/2 of every cell.

    E' = sym(F' grad v) is the rate of the Green-Lagrange strain, so that a rotation is not damped at any amplitude.

    Parameters
    ----------
    gradients : (n_cell, n_point, 3, n_local) 1/m.
    weights : (n_cell, n_point) m^3.
    cells : (n_cell, n_local).
    lame : (n_cell, 2) lambda and mu, Pa.
    initial : (n_cell, 3, 3) S_0 in Pa, or (0, 3, 3) for none; it adds S_0:E to the energy.
    u, v : (n_dof, n_case) m and m/s.
    beta : s; 0 leaves ``viscous`` alone and does not read v.
    forces, viscous : (n_cell, n_local, 3, n_case) N, overwritten.
    energies : (n_cell, n_case) J, overwritten.

    Source: Bonet & Wood, Nonlinear Continuum Mechanics for FE Analysis, 2nd ed., eqs. (6.23), (9.12).
    """
    n_cell, n_point, _, n_local = gradients.shape
    n_case = u.shape[1]
    for e in prange(n_cell):
        ue, ve = np.empty((3, n_local)), np.empty((3, n_local))
        fe, ge = np.empty((3, n_local)), np.empty((3, n_local))
        F, S, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        D, Sv, Q = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        lam, mu = lame[e, 0], lame[e, 1]
        for c in range(n_case):
            _gather_cell(u, cells[e], c, ue)
            fe[:] = 0.0
            if beta > 0.0:
                _gather_cell(v, cells[e], c, ve)
                ge[:] = 0.0
            energy = 0.0
            for q in range(n_point):
                w = weights[e, q]
                _gradient(ue, gradients[e, q], F)
                # E from grad u, not from F'F - I: no cancellation at small strain.
                energy += w * _stress(F, lam, mu, initial, e, S)
                _product(F, S, w, P)
                _add_divergence(P, gradients[e, q], fe)
                if beta > 0.0:
                    _gradient(ve, gradients[e, q], D)
                    viscous_stress(F, D, beta * lam, beta * mu, Sv)
                    _product(F, Sv, w, Q)
                    _add_divergence(Q, gradients[e, q], ge)
            energies[e, c] = energy
            for a in range(n_local):
                for i in range(3):
                    forces[e, a, i, c] = fe[i, a]
                    if beta > 0.0:
                        viscous[e, a, i, c] = ge[i, a]


@inlined
def _gather_cell(u: FloatArray, nodes: IntArray, case: int, ue: FloatArray) -> None:
    for a in range(len(nodes)):
        for i in range(3):
            ue[i, a] = u[3 * nodes[a] + i, case]


@inlined
def _gradient(ue: FloatArray, gradients: FloatArray, out: FloatArray) -> None:
    """Gradient (3, 3) of the field with nodal values ue (3, n_local)."""
    for i in range(3):
        for j in range(3):
            s = 0.0
            for a in range(ue.shape[1]):
                s += ue[i, a] * gradients[j, a]
            out[i, j] = s


@inlined
def _product(F: FloatArray, S: FloatArray, weight: float, out: FloatArray) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] = (F[i, 0] * S[0, j] + F[i, 1] * S[1, j] + F[i, 2] * S[2, j]) * weight


@inlined
def _add_divergence(P: FloatArray, gradients: FloatArray, fe: FloatArray) -> None:
    for i in range(3):
        for a in range(fe.shape[1]):
            fe[i, a] += P[i, 0] * gradients[0, a] + P[i, 1] * gradients[1, a] + P[i, 2] * gradients[2, a]


@inlined
def viscous_stress(F: FloatArray, D: FloatArray, lam: float, mu: float, S: FloatArray) -> None:
    """S <- lam tr(E') I + 2 mu E' with E' = (F'D + D'F)/2 and D the gradient of the velocity."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            s = 0.0
            for k in range(3):
                s += F[k, i] * D[k, j] + D[k, i] * F[k, j]
            S[i, j] = mu * s
        trace += S[i, i] / (2.0 * mu)
    for i in range(3):
        S[i, i] += lam * trace


@inlined
def _stress(F: FloatArray, lam: float, mu: float, initial: FloatArray, cell: int, S: FloatArray) -> float:
    """From grad u in F: F <- I + grad u, S <- S_0 + lambda tr(E) I + 2 mu E; returns (S + S_0):E/2."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            s = F[i, j] + F[j, i] + F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
            S[i, j] = 0.5 * s
        trace += S[i, i]
    energy = 0.5 * lam * trace * trace
    for i in range(3):
        for j in range(3):
            energy += mu * S[i, j] * S[i, j]
            if len(initial) > 0:
                energy += initial[cell, i, j] * S[i, j]
                S[i, j] = 2.0 * mu * S[i, j] + initial[cell, i, j]
            else:
                S[i, j] *= 2.0 * mu
        S[i, i] += lam * trace
        F[i, i] += 1.0
    return energy


@threaded
def gather(pointers: IntArray, entries: IntArray, forces: FloatArray, out: FloatArray) -> None:
    """Add cell forces to nodes in a fixed order, so that the sum does not depend on the thread count.

    pointers (n_node + 1,), entries (n_cell n_local,) flat (cell, local) numbers, forces (n_cell n_local, 3, n_case),
    out (n_dof, n_case), accumulated.
    """
    n_case = out.shape[1]
    for node in prange(len(pointers) - 1):
        for k in range(pointers[node], pointers[node + 1]):
            for i in range(3):
                for c in range(n_case):
                    out[3 * node + i, c] += forces[entries[k], i, c]


@threaded
def element_tangents(
    gradients: FloatArray,
    weights: FloatArray,
    cells: IntArray,
    lame: FloatArray,
    initial: FloatArray,
    u: FloatArray,
    geometric_share: float,
    tangents: FloatArray,
) -> None:
    """K_ab = sum_q w [(g_a.S g_b) I + lambda Fg_a (Fg_b)' + mu Fg_b (Fg_a)' + mu (g_a.g_b) F F'], g_a = grad N_a.

    u (n_dof,) m; ``geometric_share`` 1, or 0 to leave out the first term; tangents (n_cell, n_local, n_local, 3, 3)
    N/m, overwritten; the rest as in ``element_forces``.

    Source: linearisation of Bonet & Wood (9.12) for the SVK elasticity tensor.
    """
    n_cell, n_point, _, n_local = gradients.shape
    for e in prange(n_cell):
        F = np.empty((3, 3))
        S = np.empty((3, 3))
        B = np.empty((3, 3))
        Fg = np.empty((n_local, 3))
        Sg = np.empty((n_local, 3))
        lam, mu = lame[e, 0], lame[e, 1]
        tangents[e] = 0.0
        for q in range(n_point):
            w = weights[e, q]
            for i in range(3):
                for j in range(3):
                    s = 0.0
                    for a in range(n_local):
                        s += u[3 * cells[e, a] + i] * gradients[e, q, j, a]
                    F[i, j] = s
            _stress(F, lam, mu, initial, e, S)
            push_forward(F, gradients[e, q], Fg)
            push_forward(S, gradients[e, q], Sg)
            outer(F, F, B)
            add_tangent(w, lam, mu, geometric_share, gradients[e, q], Sg, Fg, Fg, B, tangents[e])


@inlined
def push_forward(F: FloatArray, gradients: FloatArray, out: FloatArray) -> None:
    """F g_a of all shape gradients, (n_local, 3)."""
    for a in range(out.shape[0]):
        for i in range(3):
            out[a, i] = F[i, 0] * gradients[0, a] + F[i, 1] * gradients[1, a] + F[i, 2] * gradients[2, a]


@inlined
def outer(F: FloatArray, X: FloatArray, out: FloatArray) -> None:
    """F X' of two 3 by 3 matrices."""
    for i in range(3):
        for j in range(3):
            out[i, j] = F[i, 0] * X[j, 0] + F[i, 1] * X[j, 1] + F[i, 2] * X[j, 2]


@inlined
def add_tangent(
    w: float,
    lam: float,
    mu: float,
    geometric_share: float,
    gradients: FloatArray,
    Sg: FloatArray,
    Fg: FloatArray,
    Xg: FloatArray,
    FX: FloatArray,
    out: FloatArray,
) -> None:
    """K_ab += w [share (g_a.S g_b) I + lambda Fg_a (Xg_b)' + mu Fg_b (Xg_a)' + mu (g_a.g_b) F X'].

    X = F gives the elastic tangent, X = grad v that of the viscous force; gradients (3, n_local), Sg, Fg, Xg
    (n_local, 3), FX (3, 3), out (n_local, n_local, 3, 3).
    """
    for a in range(Fg.shape[0]):
        for b in range(Fg.shape[0]):
            geometric = 0.0
            product = 0.0
            for i in range(3):
                geometric += gradients[i, b] * Sg[a, i]
                product += gradients[i, a] * gradients[i, b]
            for i in range(3):
                out[a, b, i, i] += geometric_share * w * geometric
                for j in range(3):
                    out[a, b, i, j] += w * (
                        lam * Fg[a, i] * Xg[b, j] + mu * Fg[b, i] * Xg[a, j] + mu * product * FX[i, j]
                    )


@compiled
def scatter_blocks(block_map: IntArray, blocks: FloatArray, out: FloatArray) -> None:
    """Add cell blocks (n_block, 3, 3) to the block-sparse data (n_nonzero_block, 3, 3) at ``block_map``."""
    for k in range(len(block_map)):
        for i in range(3):
            for j in range(3):
                out[block_map[k], i, j] += blocks[k, i, j]
