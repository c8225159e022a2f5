"""Mean rotation of every node: it turns a factor of the rest state into a preconditioner for the deflected one.

Where a thin part rotates, its stiff in-plane direction turns into the soft transverse one and the tangent of the rest
state is a poor model of the current one. Up to strains, K(u) = R K(0) R' with the local rotation R, so that R A^-1 R'
with the frozen factor A does the work of a new factor.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray
from fem.compiled import threaded
from fem.model import Model
from fem.sparse_product import SparseProduct


class NodalRotation:
    """Rotation vectors w = curl(u) / 2 averaged over the cells around each node; zero for linear bodies."""

    def __init__(self, model: Model) -> None:
        self._half_curl = SparseProduct(_half_curl(model))

    def __call__(self, u: FloatArray) -> FloatArray:
        """Rotation vectors (3 n_node, n_case) in rad at u (n_dof, n_case)."""
        return self._half_curl(u)


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


def _half_curl(model: Model) -> sp.csr_matrix:
    n_node = len(model.points)
    total = sp.csr_matrix((3 * n_node, 3 * n_node))
    volume = np.zeros(n_node)
    for cells in model.nonlinear:
        n_local = cells.nodes.shape[1]
        # Volume integrals of the shape gradients, given to every node of the cell.
        integral = np.einsum("eq,eqja->eja", cells.weights, cells.gradients)
        rows = np.repeat(cells.nodes, n_local, axis=1).ravel()
        columns = np.tile(cells.nodes, (1, n_local)).ravel()
        gradient = [np.tile(integral[:, j, :], (1, n_local)).ravel() for j in range(3)]
        # (curl u)_i = d_j u_k - d_k u_j
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            data = 0.5 * np.concatenate([gradient[j], -gradient[k]])
            row = np.concatenate([3 * rows + i, 3 * rows + i])
            column = np.concatenate([3 * columns + k, 3 * columns + j])
            total = total + sp.csr_matrix((data, (row, column)), shape=total.shape)
        np.add.at(volume, cells.nodes, cells.weights.sum(axis=1)[:, None])
    scale = np.where(volume > 0.0, 1.0 / np.where(volume > 0.0, volume, 1.0), 0.0)
    return (sp.diags(np.repeat(scale, 3)) @ total).tocsr()
