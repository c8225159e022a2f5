"""Threaded product of a sparse matrix with a block of vectors."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import threaded_gather
from fem.row_chunks import row_chunks


@threaded_gather
def _csr_times_vector(
    chunks: IntArray, indptr: IntArray, indices: IntArray, data: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """One case: sums stay in registers."""
    for chunk in prange(len(chunks) - 1):
        for row in range(chunks[chunk], chunks[chunk + 1]):
            s = 0.0
            for k in range(indptr[row], indptr[row + 1]):
                s += data[k] * x[indices[k], 0]
            out[row, 0] = s


@threaded_gather
def _csr_times_block(
    chunks: IntArray, indptr: IntArray, indices: IntArray, data: FloatArray, x: FloatArray, out: FloatArray
) -> None:
    """Several cases: the innermost loop runs over them."""
    n_case = x.shape[1]
    for chunk in prange(len(chunks) - 1):
        for row in range(chunks[chunk], chunks[chunk + 1]):
            for c in range(n_case):
                out[row, c] = 0.0
            for k in range(indptr[row], indptr[row + 1]):
                for c in range(n_case):
                    out[row, c] += data[k] * x[indices[k], c]


class SparseProduct:
    """y = A x for x (n_column, n_case), row sums in a fixed order."""

    def __init__(self, matrix: sp.csr_matrix) -> None:
        csr = matrix.tocsr()
        self._matrix = (row_chunks(csr.indptr), csr.indptr, csr.indices, csr.data)
        self._rows = csr.shape[0]

    def __call__(self, x: FloatArray) -> FloatArray:
        out = np.empty((self._rows, x.shape[1]))
        product = _csr_times_vector if x.shape[1] == 1 else _csr_times_block
        product(*self._matrix, x, out)
        return out
