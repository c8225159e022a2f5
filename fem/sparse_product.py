"""Threaded product of a sparse matrix with a block of vectors."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import threaded_gather


@threaded_gather
def _csr_times_block(indptr: IntArray, indices: IntArray, data: FloatArray, x: FloatArray, out: FloatArray) -> None:
    n_case = x.shape[1]
    for row in prange(len(indptr) - 1):
        for c in range(n_case):
            out[row, c] = 0.0
        for k in range(indptr[row], indptr[row + 1]):
            for c in range(n_case):
                out[row, c] += data[k] * x[indices[k], c]


class SparseProduct:
    """y = A x for x (n_column, n_case), row sums in a fixed order."""

    def __init__(self, matrix: sp.csr_matrix) -> None:
        csr = matrix.tocsr()
        self._indptr, self._indices, self._data = csr.indptr, csr.indices, csr.data
        self._rows = csr.shape[0]

    def __call__(self, x: FloatArray) -> FloatArray:
        out = np.empty((self._rows, x.shape[1]))
        _csr_times_block(self._indptr, self._indices, self._data, x, out)
        return out
