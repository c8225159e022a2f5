"""Sparse direct solvers behind one protocol: analyse once, factor often, solve for many right-hand sides."""

from __future__ import annotations

import importlib.util
import logging
import time
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, cast

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError, FemInputError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SolverStatistics:
    """Which solver ran, entries of its factor, its memory in bytes, number of solves, and seconds per phase."""

    name: str
    factor_entries: int
    memory_bytes: int
    solves: int
    analyse: float
    factor: float
    solve: float


class LinearSolver(Protocol):
    """A sparse direct solver for one pattern."""

    name: str

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns for the pattern of ``matrix``."""

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``, which has the analysed pattern."""

    def solve(self, right: FloatArray) -> FloatArray:
        """x with A x = right, (n,) or (n, n_right)."""

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries of the factor and memory so far."""


class SuperLU:
    """SciPy's SuperLU: always there; orders anew with every factorisation."""

    name = "superlu"

    def __init__(self, *, symmetric: bool, single: bool = False) -> None:
        # SuperLU of SciPy works in double precision only; ``single`` asks for speed, not for less accuracy.
        self._ordering = "MMD_AT_PLUS_A" if symmetric else "COLAMD"
        self._options = {"SymmetricMode": True} if symmetric else {}
        self._lu: Any = None
        self._seconds = {"analyse": 0.0, "factor": 0.0, "solve": 0.0}
        self._solves = 0

    def analyse(self, matrix: sp.csr_matrix) -> None:
        """Nothing to keep: SuperLU analyses inside its factorisation."""

    def factor(self, matrix: sp.csr_matrix) -> None:
        """Factor ``matrix``; a singular one raises ``FemConvergenceError``."""
        start = time.perf_counter()
        try:
            self._lu = spla.splu(matrix.tocsc(), permc_spec=self._ordering, options=self._options)
        except RuntimeError as error:
            advice = "look for an unconstrained or loose body"
            raise FemConvergenceError(
                "matrix is singular", where="superlu factor", value=str(error), advice=advice
            ) from error
        self._seconds["factor"] += time.perf_counter() - start

    def solve(self, right: FloatArray) -> FloatArray:
        """x with A x = right, (n,) or (n, n_right)."""
        start = time.perf_counter()
        x = np.ascontiguousarray(self._lu.solve(np.asarray(right)))
        self._seconds["solve"] += time.perf_counter() - start
        self._solves += 1
        return x

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries of the factor and memory so far."""
        entries = 0 if self._lu is None else int(self._lu.nnz)
        return SolverStatistics(self.name, entries, 12 * entries, self._solves, **self._seconds)


SYMMETRIC_ONLY = ("cholmod",)
"""Solvers of symmetric positive definite matrices; the next one takes the others."""


@cache
def available_solvers() -> tuple[str, ...]:
    """Names of the solvers that can be used here, fastest first."""
    found = ["pardiso"] if _has_pardiso() else []
    found += [name for name, package in (("cholmod", "sksparse"), ("mumps", "mumps")) if _imports(name, package)]
    return (*found, "superlu")


def _has_pardiso() -> bool:
    if not importlib.util.find_spec("pypardiso"):
        return False
    try:
        importlib.import_module("fem.pardiso").load_mkl()
    except (ImportError, OSError) as error:
        log.warning("pypardiso is installed but its MKL does not load (%s): a slower solver takes over", error)
        return False
    return True


def _imports(name: str, package: str) -> bool:
    """Whether an adapter finds its package, in a version that it knows."""
    if not importlib.util.find_spec(package):
        return False
    try:
        importlib.import_module(f"fem.{name}")
    except (ImportError, OSError) as error:
        log.warning("%s is installed but does not serve as a solver (%s)", package, error)
        return False
    return True


def make_solver(name: str = "auto", *, symmetric: bool, single: bool = False) -> LinearSolver:
    """A solver by name; "auto" takes the fastest importable one that solves this kind of matrix.

    Parameters
    ----------
    symmetric : the matrix is symmetric positive definite; where it is not, "cholmod" hands it to the next solver.
    single : single precision is good enough (preconditioner); ignored by solvers without it (all but pardiso).
    """
    chosen = available_solvers()[0] if name == "auto" else name
    if chosen in SYMMETRIC_ONLY and not symmetric:
        chosen = next(other for other in available_solvers() if other not in SYMMETRIC_ONLY)
    if chosen not in available_solvers():
        advice = f"choose one of {', '.join(available_solvers())} or install the extra 'fem'"
        raise FemInputError("unknown or missing linear solver", where="linear solver", value=name, advice=advice)
    if chosen == "pardiso":
        # Loaded only when asked for: MKL takes a second and is not on every platform.
        pardiso = importlib.import_module("fem.pardiso")
        solver: LinearSolver = pardiso.Pardiso(symmetric=symmetric, single=single)
        return solver
    if chosen == "cholmod":
        return cast(LinearSolver, importlib.import_module("fem.cholmod").Cholmod())
    if chosen == "mumps":
        return cast(LinearSolver, importlib.import_module("fem.mumps").Mumps(symmetric=symmetric))
    return SuperLU(symmetric=symmetric, single=single)
