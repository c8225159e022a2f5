"""Mean rotation of every node: it turns a factor of the rest state into a preconditioner for the deflected one.

Where a thin part rotates, its stiff in-plane direction turns into the soft transverse one and the tangent of the rest
state is a poor model of the current one. Up to strains, K(u) = R K(0) R' with the local rotation R, so that R A^-1 R'
with the frozen factor A does the work of a new factor.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import threaded, threaded_gather
from fem.model import Model


class NodalRotation:
    """Rotation vectors w = curl(u) / 2 averaged over the cells around each node; zero for linear bodies."""

    def __init__(self, model: Model) -> None:
        volume = np.zeros(len(model.points))
        parts = []
        for cells in model.nonlinear:
            # Volume integrals of the shape gradients, given to every node of the cell.
            integrals = np.ascontiguousarray(np.einsum("eq,eqja->eja", cells.weights, cells.gradients))
            parts.append((integrals, cells.nodes, cells.pointers, cells.entries // cells.nodes.shape[1]))
            np.add.at(volume, cells.nodes, cells.weights.sum(axis=1)[:, None])
        self._parts = tuple(parts)
        self._scale = np.where(volume > 0.0, 0.5 / np.where(volume > 0.0, volume, 1.0), 0.0)

    def __call__(self, u: FloatArray) -> FloatArray:
        """Rotation vectors (3 n_node, n_case) in rad at u (n_dof, n_case)."""
        w = np.zeros_like(u)
        for integrals, nodes, pointers, around in self._parts:
            curls = np.empty((len(nodes), 3, u.shape[1]))
            _cell_curls(integrals, nodes, u, curls)
            _node_averages(pointers, around, self._scale, curls, w)
        return w


@threaded
def rotate(w: FloatArray, sign: float, x: FloatArray) -> FloatArray:
    """R x (sign = 1) or R' x (sign = -1) node by node with R = exp([w]): Rodrigues' formula.

    w, x : (3 n_node, n_case).
    """
    out = np.empty_like(x)
    for node in prange(x.shape[0] // 3):
        i, j, k = 3 * node, 3 * node + 1, 3 * node + 2
        for c in range(x.shape[1]):
            a, b, d = sign * w[i, c], sign * w[j, c], sign * w[k, c]
            angle2 = a * a + b * b + d * d
            # sin(t)/t and (1 - cos t)/t^2 with their series where the quotient would cancel.
            if angle2 < 1e-6:
                s, v = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
            else:
                angle = np.sqrt(angle2)
                s, v = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle2
            p, q, r = x[i, c], x[j, c], x[k, c]
            y0, y1, y2 = b * r - d * q, d * p - a * r, a * q - b * p
            out[i, c] = p + s * y0 + v * (b * y2 - d * y1)
            out[j, c] = q + s * y1 + v * (d * y0 - a * y2)
            out[k, c] = r + s * y2 + v * (a * y1 - b * y0)
    return out


@threaded_gather
def _cell_curls(integrals: FloatArray, nodes: IntArray, u: FloatArray, curls: FloatArray) -> None:
    """Volume integral of (curl u)_i = d_j u_k - d_k u_j over every cell, (n_cell, 3, n_case)."""
    for e in prange(len(nodes)):
        for c in range(u.shape[1]):
            p, q, r = 0.0, 0.0, 0.0
            for a in range(nodes.shape[1]):
                gx, gy, gz = integrals[e, 0, a], integrals[e, 1, a], integrals[e, 2, a]
                k = 3 * nodes[e, a]
                x, y, z = u[k, c], u[k + 1, c], u[k + 2, c]
                p += gy * z - gz * y
                q += gz * x - gx * z
                r += gx * y - gy * x
            curls[e, 0, c], curls[e, 1, c], curls[e, 2, c] = p, q, r


@threaded_gather
def _node_averages(pointers: IntArray, around: IntArray, scale: FloatArray, curls: FloatArray, w: FloatArray) -> None:
    """w += scale times the sum over the cells around each node."""
    for node in prange(len(pointers) - 1):
        for k in range(pointers[node], pointers[node + 1]):
            for i in range(3):
                for c in range(w.shape[1]):
                    w[3 * node + i, c] += scale[node] * curls[around[k], i, c]
