"""MKL PARDISO with separate phases, symmetric storage and single precision, over the MKL that pypardiso loads."""

from __future__ import annotations

import ctypes
import time
from typing import Any

import numpy as np
import scipy.sparse as sp
from pypardiso import PyPardisoSolver

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import SolverStatistics

_SPD, _UNSYMMETRIC = 2, 11
_ANALYSE, _FACTOR, _SOLVE, _RELEASE = 11, 22, 33, -1


class Pardiso:
    """One matrix pattern, analysed once and factored as often as its values change.

    iparm numbers are those of the MKL reference (one-based there, zero-based here).
    """

    name = "pardiso"

    def __init__(self, *, symmetric: bool, single: bool = False) -> None:
        self._call = PyPardisoSolver()._mkl_pardiso
        self._mtype = _SPD if symmetric else _UNSYMMETRIC
        self._dtype: Any = np.float32 if single else np.float64
        self._pt = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        self._iparm[[0, 1, 9, 17, 34]] = 1, 2, 13, -1, 1
        self._iparm[27] = int(single)
        if not symmetric:
            self._iparm[[10, 12]] = 1, 1
        self._matrix: sp.csr_matrix | None = None
        self._seconds = {"analyse": 0.0, "factor": 0.0, "solve": 0.0}
        self._solves = 0

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns for the pattern of ``matrix``."""
        self._set(matrix)
        self._timed("analyse", _ANALYSE)

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``, which has the analysed pattern."""
        self._set(matrix)
        self._timed("factor", _FACTOR)

    def solve(self, right: FloatArray) -> FloatArray:
        """x with A x = right, (n,) or (n, n_right)."""
        b = np.asfortranarray(right, dtype=self._dtype)
        x = np.empty_like(b)
        self._timed("solve", _SOLVE, b, x)
        self._solves += 1
        return np.ascontiguousarray(x, dtype=np.float64)

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries of the factor and memory so far."""
        memory = 1024 * int(max(self._iparm[14], self._iparm[15] + self._iparm[16]))
        return SolverStatistics(self.name, int(self._iparm[17]), memory, self._solves, **self._seconds)

    def __del__(self) -> None:
        if self._matrix is not None:
            self._run(_RELEASE)

    def _set(self, matrix: sp.csr_matrix) -> None:
        stored = sp.triu(matrix, format="csr") if self._mtype == _SPD else matrix.tocsr()
        stored.sort_indices()
        indices = (stored.indptr.astype(np.int32), stored.indices.astype(np.int32))
        self._matrix = sp.csr_matrix((stored.data.astype(self._dtype), indices[1], indices[0]), shape=stored.shape)

    def _timed(self, key: str, phase: int, b: FloatArray | None = None, x: FloatArray | None = None) -> None:
        start = time.perf_counter()
        error = self._run(phase, b, x)
        self._seconds[key] += time.perf_counter() - start
        if error:
            advice = "the matrix is singular or indefinite: look for an unconstrained or loose body"
            raise FemConvergenceError("direct solver failed", where=f"pardiso {key}", value=error, advice=advice)

    def _run(self, phase: int, b: FloatArray | None = None, x: FloatArray | None = None) -> int:
        matrix = self._matrix
        if matrix is None:
            raise FemConvergenceError("solve before analyse", where="pardiso")
        one, zero, error = ctypes.c_int32(1), ctypes.c_int32(0), ctypes.c_int32(0)
        columns = 1 if b is None or b.ndim == 1 else b.shape[1]
        self._call(
            self._pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            ctypes.byref(one),
            ctypes.byref(one),
            ctypes.byref(ctypes.c_int32(self._mtype)),
            ctypes.byref(ctypes.c_int32(phase)),
            ctypes.byref(ctypes.c_int32(matrix.shape[0])),
            matrix.data.ctypes.data_as(ctypes.c_void_p),
            matrix.indptr.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)),
            matrix.indices.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)),
            ctypes.byref(zero),
            ctypes.byref(ctypes.c_int32(columns)),
            self._iparm.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)),
            ctypes.byref(zero),
            None if b is None else b.ctypes.data_as(ctypes.c_void_p),
            None if x is None else x.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(error),
        )
        return int(error.value)
