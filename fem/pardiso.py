"""MKL PARDISO with separate phases, symmetric storage and single precision, over the MKL that pypardiso loads."""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import os
import time
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import SolverStatistics

# MKL's threads spin for 0.2 s after each call and take the cores from the other loops of a step: on two busy cores a
# step of 22,000 unknowns took 30 to 280 ms, without spinning 29 ms. Read once, when MKL starts.
os.environ.setdefault("KMP_BLOCKTIME", "0")
# Sums in an order that does not depend on where memory lies: a killed run that goes on in a new process, and the same
# run made twice, give the same bits (conditional numerical reproducibility of MKL, same machine and thread count).
os.environ.setdefault("MKL_CBWR", "AUTO")

_SPD, _INDEFINITE, _UNSYMMETRIC = 2, -2, 11
_ANALYSE, _FACTOR, _SOLVE, _RELEASE = 11, 22, 33, -1
_LOOSE = ("matrix is singular or indefinite", "look for an unconstrained or loose body")
_FAILURES = {-2: ("not enough memory", "use a coarser mesh"), -4: _LOOSE, -7: _LOOSE}
"""What MKL's error codes mean and what to do; negative pivots and zero diagonals come from loose bodies."""


class Pardiso:
    """One matrix pattern, analysed once and factored as often as its values change.

    iparm numbers are those of the MKL reference (one-based there, zero-based here).
    """

    name = "pardiso"

    def __init__(self, *, symmetric: bool, single: bool = False, definite: bool = True) -> None:
        self._mtype = (_SPD if definite else _INDEFINITE) if symmetric else _UNSYMMETRIC
        self._dtype: Any = np.float32 if single else np.float64
        self._handle = _Handle(load_mkl(), self._mtype)
        self._handle.iparm[27] = int(single)
        if symmetric and not definite:
            # Pivots of 1 x 1 and 2 x 2 by Bunch and Kaufman: their signs are those of the eigenvalues.
            self._handle.iparm[20] = 1
        elif symmetric:
            # Two-level factorisation: without it, MKL's reproducible mode solves one right-hand side on one thread.
            self._handle.iparm[23] = 1
        else:
            self._handle.iparm[[10, 12]] = 1, 1
        self._matrix = sp.csr_matrix((0, 0))
        self._seconds = {"analyse": 0.0, "factor": 0.0, "solve": 0.0}
        self._solves = 0
        # A finaliser also runs at exit, before the interpreter tears down the modules that the call needs.
        weakref.finalize(self, self._handle.call, _RELEASE, self._matrix)

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns for the pattern of ``matrix``."""
        self._store(matrix)
        self._timed("analyse", _ANALYSE)

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``, which has the analysed pattern."""
        self._store(matrix)
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
        iparm = self._handle.iparm
        memory = 1024 * int(max(iparm[14], iparm[15] + iparm[16]))
        return SolverStatistics(self.name, int(iparm[17]), memory, self._solves, **self._seconds)

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of the matrix factored last; symmetric, indefinite matrices only."""
        return int(self._handle.iparm[22])

    def _store(self, matrix: sp.csr_matrix) -> None:
        stored = sp.triu(matrix, format="csr") if self._mtype != _UNSYMMETRIC else matrix.tocsr()
        stored.sort_indices()
        indptr, indices = stored.indptr.astype(np.int32), stored.indices.astype(np.int32)
        self._matrix = sp.csr_matrix((stored.data.astype(self._dtype), indices, indptr), shape=stored.shape)

    def _timed(self, key: str, phase: int, b: FloatArray | None = None, x: FloatArray | None = None) -> None:
        start = time.perf_counter()
        error = self._handle.call(phase, self._matrix, b, x)
        self._seconds[key] += time.perf_counter() - start
        if error:
            what, advice = _FAILURES.get(error, ("direct solver failed", "see the error codes of MKL PARDISO"))
            raise FemConvergenceError(what, where=f"pardiso {key}", value=error, advice=advice)


@cache
def load_mkl() -> Callable[..., None]:
    """MKL's pardiso; ``ImportError`` where it is missing."""
    library = _mkl_library()
    if library is not None:
        os.environ.setdefault("PYPARDISO_MKL_RT", library)
    # Loads MKL, so not before the environment above is set.
    solver = importlib.import_module("pypardiso").ps
    function: Callable[..., None] = solver._mkl_pardiso
    return function


def _mkl_library() -> str | None:
    """Path of mkl_rt in the installed package mkl; None leaves the search to pypardiso.

    That one lists all files of the environment: half a second at every start.
    """
    try:
        files = importlib.metadata.files("mkl") or []
    except importlib.metadata.PackageNotFoundError:
        return None
    found = [str(file.locate()) for file in files if "mkl_rt" in file.name]
    return next((path for path in found if os.path.isfile(path)), None)


class _Handle:
    """MKL's own memory and parameters of one factorisation."""

    def __init__(self, function: Callable[..., None], mtype: int) -> None:
        self._function, self._mtype = function, mtype
        self._pt = np.zeros(64, dtype=np.int64)
        self.iparm = np.zeros(64, dtype=np.int32)
        # 1: own parameters; 2: METIS; 10: pivot perturbation; 18: report entries; 35: zero-based indices.
        self.iparm[[0, 1, 9, 17, 34]] = 1, 2, 13, -1, 1

    def call(
        self, phase: int, matrix: sp.csr_matrix, b: npt.NDArray[Any] | None = None, x: npt.NDArray[Any] | None = None
    ) -> int:
        """One phase; returns MKL's error code."""
        one, zero, error = ctypes.c_int32(1), ctypes.c_int32(0), ctypes.c_int32(0)
        columns = 1 if b is None or b.ndim == 1 else b.shape[1]
        integers = ctypes.POINTER(ctypes.c_int32)
        self._function(
            self._pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            ctypes.byref(one),
            ctypes.byref(one),
            ctypes.byref(ctypes.c_int32(self._mtype)),
            ctypes.byref(ctypes.c_int32(phase)),
            ctypes.byref(ctypes.c_int32(matrix.shape[0])),
            matrix.data.ctypes.data_as(ctypes.c_void_p),
            matrix.indptr.ctypes.data_as(integers),
            matrix.indices.ctypes.data_as(integers),
            ctypes.byref(zero),
            ctypes.byref(ctypes.c_int32(columns)),
            self.iparm.ctypes.data_as(integers),
            ctypes.byref(zero),
            None if b is None else b.ctypes.data_as(ctypes.c_void_p),
            None if x is None else x.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(error),
        )
        return int(error.value)
