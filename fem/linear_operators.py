"""Products with mass and constant stiffness: what an implicit step needs besides the nonlinear forces."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import threaded_gather
from fem.errors import FemInputError
from fem.row_chunks import row_chunks


class LinearOperators:
    """x -> (M x, K x) for x (n_dof, n_case), sums in a fixed order.

    Mass acts alike in all directions and is kept as one number per pair of nodes, stiffness as blocks of 3 x 3: the
    products are bound by memory, and this reads a third and two thirds of what general sparse matrices read.

    Parameters
    ----------
    mass : (n_dof, n_dof) kg, scalar between nodes; another raises ``FemInputError``.
    stiffness : (n_dof, n_dof) N/m.
    """

    def __init__(self, mass: sp.csr_matrix, stiffness: sp.csr_matrix) -> None:
        scalar = sp.csr_matrix(mass[::3, ::3])
        rest = mass - sp.kron(scalar, sp.identity(3), format="csr")
        if rest.nnz and np.abs(rest.data).max() > 1e-12 * np.abs(scalar.data).max():
            raise FemInputError("mass must act alike in all directions", where="linear operators")
        blocks = stiffness.tobsr((3, 3))
        self._mass = (row_chunks(scalar.indptr), scalar.indptr, scalar.indices, scalar.data)
        entries = np.ascontiguousarray(blocks.data)
        self._stiffness = (row_chunks(blocks.indptr), blocks.indptr, blocks.indices, entries)

    def stiffness(self, x: FloatArray) -> FloatArray:
        """K x (n_dof, n_case)."""
        out = np.empty_like(x)
        product = _blocks_one if x.shape[1] == 1 else _blocks
        product(*self._stiffness, np.ascontiguousarray(x), out)
        return out

    def __call__(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M x and K x, each (n_dof, n_case)."""
        mass_x = np.empty_like(x)
        product = _scalars_one if x.shape[1] == 1 else _scalars
        product(*self._mass, np.ascontiguousarray(x), mass_x)
        return mass_x, self.stiffness(x)


@threaded_gather
def _scalars_one(
    chunks: IntArray, pointers: IntArray, columns: IntArray, mass: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """One case: sums stay in registers."""
    for chunk in prange(len(chunks) - 1):
        for node in range(chunks[chunk], chunks[chunk + 1]):
            p, q, r = 0.0, 0.0, 0.0
            for k in range(pointers[node], pointers[node + 1]):
                j = 3 * columns[k]
                p += mass[k] * x[j, 0]
                q += mass[k] * x[j + 1, 0]
                r += mass[k] * x[j + 2, 0]
            out[3 * node, 0], out[3 * node + 1, 0], out[3 * node + 2, 0] = p, q, r


@threaded_gather
def _blocks_one(
    chunks: IntArray, pointers: IntArray, columns: IntArray, blocks: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """One case: sums stay in registers."""
    for chunk in prange(len(chunks) - 1):
        for node in range(chunks[chunk], chunks[chunk + 1]):
            p, q, r = 0.0, 0.0, 0.0
            for k in range(pointers[node], pointers[node + 1]):
                j = 3 * columns[k]
                x0, x1, x2 = x[j, 0], x[j + 1, 0], x[j + 2, 0]
                p += blocks[k, 0, 0] * x0 + blocks[k, 0, 1] * x1 + blocks[k, 0, 2] * x2
                q += blocks[k, 1, 0] * x0 + blocks[k, 1, 1] * x1 + blocks[k, 1, 2] * x2
                r += blocks[k, 2, 0] * x0 + blocks[k, 2, 1] * x1 + blocks[k, 2, 2] * x2
            out[3 * node, 0], out[3 * node + 1, 0], out[3 * node + 2, 0] = p, q, r


@threaded_gather
def _scalars(
    chunks: IntArray, pointers: IntArray, columns: IntArray, mass: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """Several cases: the innermost loop runs over them."""
    n_case = x.shape[1]
    for chunk in prange(len(chunks) - 1):
        for node in range(chunks[chunk], chunks[chunk + 1]):
            out[3 * node : 3 * node + 3] = 0.0
            for k in range(pointers[node], pointers[node + 1]):
                m, j = mass[k], 3 * columns[k]
                for i in range(3):
                    for c in range(n_case):
                        out[3 * node + i, c] += m * x[j + i, c]


@threaded_gather
def _blocks(
    chunks: IntArray, pointers: IntArray, columns: IntArray, blocks: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """Several cases: the innermost loop runs over them."""
    n_case = x.shape[1]
    for chunk in prange(len(chunks) - 1):
        for node in range(chunks[chunk], chunks[chunk + 1]):
            out[3 * node : 3 * node + 3] = 0.0
            for k in range(pointers[node], pointers[node + 1]):
                j = 3 * columns[k]
                for i in range(3):
                    a, b, d = blocks[k, i, 0], blocks[k, i, 1], blocks[k, i, 2]
                    for c in range(n_case):
                        out[3 * node + i, c] += a * x[j, c] + b * x[j + 1, c] + d * x[j + 2, c]
