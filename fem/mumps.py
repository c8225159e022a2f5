"""MUMPS by python-mumps: multifrontal factors of symmetric (L D L') and unsymmetric matrices."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import scipy.sparse as sp
from mumps import Context, MUMPSError

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import SolverStatistics


class Mumps:
    """One matrix pattern, ordered once and factored as often as its values change; double precision only."""

    name = "mumps"

    def __init__(self, *, symmetric: bool) -> None:
        self._symmetric = symmetric
        self._context: Any = Context()
        self._seconds = {"analyse": 0.0, "factor": 0.0, "solve": 0.0}
        self._solves = 0

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns for the pattern of ``matrix``."""
        start = time.perf_counter()
        self._context.set_matrix(matrix.tocoo(), symmetric=self._symmetric)
        self._context.analyze()
        self._seconds["analyse"] += time.perf_counter() - start

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``; a singular one raises ``FemConvergenceError``."""
        start = time.perf_counter()
        try:
            self._context.set_matrix(matrix.tocoo(), symmetric=self._symmetric)
            self._context.factor(reuse_analysis=True)
        except MUMPSError as error:
            advice = "look for an unconstrained or loose body"
            raise FemConvergenceError(
                "matrix is singular", where="mumps factor", value=str(error), advice=advice
            ) from error
        self._seconds["factor"] += time.perf_counter() - start

    def solve(self, right: FloatArray) -> FloatArray:
        """x with A x = right, (n,) or (n, n_right)."""
        start = time.perf_counter()
        x = np.ascontiguousarray(self._context.solve(np.asfortranarray(right, dtype=np.float64)))
        self._seconds["solve"] += time.perf_counter() - start
        self._solves += 1
        return x

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries of the factor and memory so far."""
        found = self._context.factor_stats
        entries, megabytes = (0, 0) if found is None else (int(found.nonzeros), int(found.memory))
        return SolverStatistics(self.name, entries, megabytes * 10**6, self._solves, **self._seconds)
