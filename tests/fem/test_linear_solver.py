"""Direct solvers: agreement, single precision as preconditioner, singular matrices."""

from __future__ import annotations

import importlib
import importlib.util

import numpy as np
import pytest
import scipy.sparse as sp

from fem.errors import FemConvergenceError, FemInputError
from fem.linear_solver import SYMMETRIC_ONLY, available_solvers, make_solver
from tests.fem.small_models import clamped_strip

SOLVERS = available_solvers()


def _matrix(n: int = 12, *, skew: float = 0.0, shift: float = 0.05) -> sp.csr_matrix:
    line = sp.diags([-1.0 - skew, 2.0 + shift, -1.0 + skew], [-1, 0, 1], (n, n))
    return sp.csr_matrix(sp.kronsum(sp.kronsum(line, line), line))


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("symmetric", [True, False])
def test_solves_one_and_many_right_sides(name: str, symmetric: bool) -> None:
    matrix = _matrix(skew=0.0 if symmetric else 0.3)
    x = np.random.default_rng(1).standard_normal((matrix.shape[0], 3))
    solver = make_solver(name, symmetric=symmetric)
    solver.analyse(matrix)
    solver.factor(matrix)
    # Condition number below 250: 1e-10 is the agreement asked of all solvers and leaves four digits of room.
    np.testing.assert_allclose(solver.solve(matrix @ x), x, atol=1e-10)
    np.testing.assert_allclose(solver.solve(matrix @ x[:, 0]), x[:, 0], atol=1e-10)
    if symmetric or name not in SYMMETRIC_ONLY:
        assert solver.statistics.name == name
    else:
        assert solver.statistics.name not in SYMMETRIC_ONLY
    assert solver.statistics.solves == 2
    assert solver.statistics.factor_entries > matrix.nnz // 2


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("symmetric", [True, False])
def test_all_agree_on_a_strip_in_its_joints(name: str, symmetric: bool) -> None:
    """Iteration matrix of a step of 0.1 ms of a strip in its joints, against SuperLU: 1e-10 of the largest.

    The static tangent alone has a condition number of 1e7: there SuperLU differs from itself with another ordering by
    4e-10.
    """
    model = clamped_strip()
    closed = np.ones(model.contact.n_point, dtype=np.int64)
    matrix = model.constrain(model.elastic_tangent(np.zeros(model.n_dof)))
    matrix = matrix + model.constrain(model.contact.stick_tangent(closed) + 4.0 / 1e-4**2 * model.mass)
    matrix = matrix.tocsr()
    right = np.where(model.free, model.mass @ model.direction("y"), 0.0)
    found = []
    for solver in (make_solver(name, symmetric=symmetric), make_solver("superlu", symmetric=False)):
        solver.analyse(matrix)
        solver.factor(matrix)
        found.append(solver.solve(right))
    assert np.abs(found[0] - found[1]).max() < 1e-10 * np.abs(found[1]).max()


@pytest.mark.parametrize("name", SOLVERS)
def test_factor_follows_new_values(name: str) -> None:
    solver = make_solver(name, symmetric=True)
    solver.analyse(_matrix())
    for shift in (0.05, 0.5):
        matrix = _matrix(shift=shift)
        solver.factor(matrix)
        np.testing.assert_allclose(solver.solve(matrix @ np.ones(matrix.shape[0])), 1.0, atol=1e-10)


@pytest.mark.parametrize("name", SOLVERS)
def test_single_precision_preconditions_to_double(name: str) -> None:
    """Refinement contracts by about condition number * 1e-7 per step."""
    matrix = _matrix()
    b = np.random.default_rng(2).standard_normal(matrix.shape[0])
    solver = make_solver(name, symmetric=True, single=True)
    solver.analyse(matrix)
    solver.factor(matrix)
    x = solver.solve(b)
    first = np.linalg.norm(b - matrix @ x) / np.linalg.norm(b)
    assert first < 1e-4
    for _ in range(3):
        x = x + solver.solve(b - matrix @ x)
    assert np.linalg.norm(b - matrix @ x) < 1e-13 * np.linalg.norm(b)
    if name == "pardiso":
        assert first > 1e-12, "the factor was not in single precision"


@pytest.mark.parametrize("name", SOLVERS)
def test_singular_matrix_is_refused(name: str) -> None:
    matrix = sp.csr_matrix(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]))
    solver = make_solver(name, symmetric=True)
    solver.analyse(matrix)
    with pytest.raises(FemConvergenceError, match="loose body"):
        solver.factor(matrix)


def test_unknown_solver_lists_the_available_ones() -> None:
    with pytest.raises(FemInputError, match="superlu"):
        make_solver("umfpack", symmetric=True)
    assert make_solver(symmetric=True).name == SOLVERS[0]


def test_mkl_that_does_not_load_gives_way(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """Such as a wheel whose libraries were removed: the name is found, the library is not."""

    def missing(name: str) -> object:
        raise ImportError("Shared library mkl_rt not found")

    available_solvers.cache_clear()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: True)
    monkeypatch.setattr(importlib, "import_module", missing)
    try:
        assert available_solvers() == ("superlu",)
        assert "mkl_rt not found" in caplog.text
    finally:
        available_solvers.cache_clear()
