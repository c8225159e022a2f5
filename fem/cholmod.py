"""CHOLMOD of SuiteSparse by scikit-sparse: supernodal Cholesky factors of symmetric positive definite matrices."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import scipy.sparse as sp
from sksparse.cholmod import CholmodError, analyze

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import SolverStatistics


class Cholmod:
    """One matrix pattern, ordered once and factored as often as its values change; double precision only."""

    name = "cholmod"

    def __init__(self) -> None:
        self._factor: Any = None
        self._factored = False
        self._seconds = {"analyse": 0.0, "factor": 0.0, "solve": 0.0}
        self._solves = 0

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns for the pattern of ``matrix``."""
        start = time.perf_counter()
        # Supernodal factors are L L': a pivot that is not positive is an error, and BLAS does the work.
        self._factor = analyze(matrix.tocsc(), mode="supernodal", ordering_method="metis")
        self._seconds["analyse"] += time.perf_counter() - start

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``; one that is not positive definite raises ``FemConvergenceError``."""
        start = time.perf_counter()
        try:
            self._factor.cholesky_inplace(matrix.tocsc())
        except CholmodError as error:
            advice = "look for an unconstrained or loose body"
            what = "matrix is singular or indefinite"
            raise FemConvergenceError(what, where="cholmod factor", value=str(error), advice=advice) from error
        self._factored = True
        self._seconds["factor"] += time.perf_counter() - start

    def solve(self, right: FloatArray) -> FloatArray:
        """x with A x = right, (n,) or (n, n_right)."""
        start = time.perf_counter()
        x = np.ascontiguousarray(self._factor(np.asarray(right, dtype=np.float64)))
        self._seconds["solve"] += time.perf_counter() - start
        self._solves += 1
        return x

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries of the factor and memory so far; counting them copies the factor."""
        entries = int(self._factor.L().nnz) if self._factored else 0
        return SolverStatistics(self.name, entries, 8 * entries, self._solves, **self._seconds)
