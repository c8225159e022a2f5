"""The shallow von Karman shell in 1:2 resonance: its given equations, their forces and a fifth-order integrator.

The file ``linpart.mat`` holds x' = A x of x = (q, q') with A = [0, I; -M^-1 K, -M^-1 C] and ten modes (V right, W left
eigenvectors); ``tensors_400.mat`` the sparse tensors of the unconstrained mesh of 400 triangles, 231 nodes with three
translations and three rotations. Both edges of 11 nodes have no translation. M is block-diagonal (one symmetric 6 x 6
block per node) and follows from W = Phi' M:

    M q'' + C q' + K q + T2(q, q) + T3(q, q, q) = f
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numba
import numpy as np
import scipy.io
import scipy.sparse as sp

from romgen.arrays import ComplexArray, FloatArray, IntArray

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "von_karman_shell"
NODES, ACROSS, PER_NODE = 231, 11, 6


@dataclass(frozen=True)
class SparseTensor:
    """A symmetrised force g_i = sum over the terms of row i of value q_j q_k (q_l), each product once.

    Attributes
    ----------
    rows : (n_dof + 1,) first term of every row; factors : (n_term, 2 or 3) degrees of freedom; values : (n_term,).
    """

    rows: IntArray = field(metadata={"unit": "1", "axes": "row"})
    factors: IntArray = field(metadata={"unit": "1", "axes": "term,factor"})
    values: FloatArray = field(metadata={"unit": "N/m^2 or N/m^3", "axes": "term"})


@dataclass(frozen=True)
class Shell:
    """Matrices and tensors on the 1320 free degrees of freedom.

    Attributes
    ----------
    free : (n,) numbers on the unconstrained mesh, 6 node + component.
    M, C, K : (n, n); quadratic, cubic : T2 and T3.
    shapes : (n, 10) M-normalised modes; eigenvalues : (10,) those given, Im > 0.
    """

    free: IntArray = field(metadata={"unit": "1", "axes": "dof"})
    M: sp.csr_matrix
    C: sp.csr_matrix
    K: sp.csr_matrix
    quadratic: SparseTensor
    cubic: SparseTensor
    shapes: FloatArray = field(metadata={"unit": "kg^-0.5", "axes": "dof,mode"})
    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})

    def force(self, q: FloatArray) -> FloatArray:
        """Return T2(q, q) + T3(q, q, q), (n,)."""
        return _squares(self.quadratic.rows, self.quadratic.factors, self.quadratic.values, q) + _cubes(
            self.cubic.rows, self.cubic.factors, self.cubic.values, q
        )


def read_shell(folder: Path = DATA) -> Shell:
    """Read the shell; M from W = Phi' M block by block."""
    linear = scipy.io.loadmat(folder / "linpart.mat")
    n = linear["A"].shape[0] // 2
    A, V, W = linear["A"].tocsr(), linear["V"].toarray(), linear["W"].toarray()
    number = np.arange(NODES * PER_NODE)
    node, component = number // PER_NODE, number % PER_NODE
    free = number[((node >= ACROSS) & (node < NODES - ACROSS)) | (component >= 3)]
    shapes, left = V[:n, ::2], W[::2, :n].T
    M = nodal_mass(shapes, left, free // PER_NODE)
    position = np.full(number.size, -1)
    position[free] = np.arange(n)
    with h5py.File(folder / "tensors_400.mat") as file:
        groups = [file[reference] for reference in file["fnl"][()].ravel()]
        tensors = [symmetrised(group["subs"][()], group["vals"][()].ravel(), position, n) for group in groups]
    return Shell(
        free,
        M,
        (-M @ A[n:, n:]).tocsr(),
        (-M @ A[n:, :n]).tocsr(),
        *tensors,
        shapes,
        linear["lambda"].ravel()[:10],
    )


def nodal_mass(shapes: FloatArray, left: FloatArray, node: IntArray) -> sp.csr_matrix:
    """Return the block-diagonal symmetric M of M shapes = left by least squares in every node."""
    blocks = []
    for k in range(node.max() + 1):
        dofs = np.flatnonzero(node == k)
        upper = np.triu_indices(dofs.size)
        unit = np.zeros((upper[0].size, dofs.size, dofs.size))
        unit[np.arange(upper[0].size), upper[0], upper[1]] = 1.0
        unit[np.arange(upper[0].size), upper[1], upper[0]] = 1.0
        G = np.einsum("kab,bm->kam", unit, shapes[dofs]).reshape(upper[0].size, -1).T
        size = np.linalg.norm(G, axis=0)
        values = np.linalg.lstsq(G / size, left[dofs].ravel(), rcond=None)[0] / size
        blocks.append(np.einsum("k,kab->ab", values, unit))
    return sp.block_diag(blocks, format="csr")


def symmetrised(subscripts: FloatArray, values: FloatArray, position: IntArray, n: int) -> SparseTensor:
    """Return the tensor on the free degrees of freedom, factors sorted and equal products added.

    Parameters
    ----------
    subscripts : (order, n_entry) from 1, the first is the row.
    position : (n_all,) number of each degree of freedom among the free ones, -1 where fixed.
    """
    index = position[subscripts.astype(np.int64) - 1]
    kept = (index >= 0).all(axis=0) & (values != 0.0)
    row, factors = index[0, kept], np.sort(index[1:, kept], axis=0)
    key = row.astype(np.int64)
    for factor in factors:
        key = key * n + factor
    unique, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    total = np.bincount(inverse, weights=values[kept], minlength=unique.size)
    strong = np.abs(total) > np.finfo(float).eps * np.abs(total).max()
    row, factors = row[first][strong], factors[:, first][:, strong]
    return SparseTensor(
        np.searchsorted(row, np.arange(n + 1)), np.ascontiguousarray(factors.T, dtype=np.int32), total[strong]
    )


def products(tensor: SparseTensor, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the symmetric bilinear force T2(a, b), (n,), of real or complex vectors."""
    return _products(tensor.rows, tensor.factors, tensor.values, a, b)


def cubes(tensor: SparseTensor, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the symmetric trilinear force T3(a, b, c), (n,)."""
    terms = (a, b, c), (a, c, b), (b, a, c), (b, c, a), (c, a, b), (c, b, a)
    return sum(_triples(tensor.rows, tensor.factors, tensor.values, *term) for term in terms) / 6.0


@numba.njit(cache=True)
def _products(rows, factors, values, a, b):  # type: ignore[no-untyped-def]
    g = np.zeros_like(a)
    for i in range(rows.size - 1):
        for k in range(rows[i], rows[i + 1]):
            j, m = factors[k, 0], factors[k, 1]
            g[i] += 0.5 * values[k] * (a[j] * b[m] + a[m] * b[j])
    return g


@numba.njit(cache=True)
def _squares(rows, factors, values, a):  # type: ignore[no-untyped-def]
    g = np.zeros_like(a)
    for i in range(rows.size - 1):
        for k in range(rows[i], rows[i + 1]):
            g[i] += values[k] * a[factors[k, 0]] * a[factors[k, 1]]
    return g


@numba.njit(cache=True)
def _cubes(rows, factors, values, a):  # type: ignore[no-untyped-def]
    g = np.zeros_like(a)
    for i in range(rows.size - 1):
        for k in range(rows[i], rows[i + 1]):
            g[i] += values[k] * a[factors[k, 0]] * a[factors[k, 1]] * a[factors[k, 2]]
    return g


@numba.njit(cache=True)
def _triples(rows, factors, values, a, b, c):  # type: ignore[no-untyped-def]
    g = np.zeros_like(a)
    for i in range(rows.size - 1):
        for k in range(rows[i], rows[i + 1]):
            g[i] += values[k] * a[factors[k, 0]] * b[factors[k, 1]] * c[factors[k, 2]]
    return g
