"""Bordered systems by GMRES on an older symmetric factor, against dense solutions."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.tangent_solver import RELATIVE, TangentSolver

N, RNG = 60, np.random.default_rng(2)


def _system(asymmetry: float, shift: float = 0.0) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """A tangent and its symmetric part, positive definite for shift = 0."""
    chain = sp.diags([2.0 - shift, -1.0, -1.0], [0, 1, -1], shape=(N, N)).tocsr()
    skew = sp.diags([asymmetry, -asymmetry], [1, -1], shape=(N, N))
    return (chain + skew).tocsr(), chain


def _misfit(tangent: sp.csr_matrix, border: FloatArray, solver: TangentSolver, symmetric: sp.csr_matrix) -> float:
    r, m = RNG.standard_normal(N), RNG.standard_normal(border.shape[1])
    x, y = solver.solve(tangent, lambda: symmetric, r, m)
    missed = np.concatenate([tangent @ x - border @ y - r, border.T @ x - m])
    return float(np.linalg.norm(missed) / np.linalg.norm(np.concatenate([r, m])))


@pytest.mark.parametrize("sides", [0, 2])
def test_the_solution_fulfils_the_bordered_system(sides: int) -> None:
    tangent, symmetric = _system(0.3)
    border = RNG.standard_normal((N, sides))
    solver = TangentSolver(border, "superlu")
    assert _misfit(tangent, border, solver, symmetric) <= RELATIVE
    assert solver.factors == 1


def test_the_factor_is_kept_while_it_serves() -> None:
    tangent, symmetric = _system(0.05)
    solver = TangentSolver(np.zeros((N, 0)), "superlu")
    for scale in (1.0, 1.1, 1.2):
        assert _misfit((scale * tangent).tocsr(), np.zeros((N, 0)), solver, symmetric) <= RELATIVE
    assert solver.factors == 1
    solver.forget()
    assert _misfit(tangent, np.zeros((N, 0)), solver, symmetric) <= RELATIVE
    assert solver.factors == 2


def test_a_poor_factor_is_renewed_and_a_hopeless_one_gives_way_to_the_tangent_itself() -> None:
    tangent, symmetric = _system(0.1)
    far = sp.diags(np.geomspace(1.0, 1e8, N)).tocsr()
    solver = TangentSolver(np.zeros((N, 0)), "superlu")
    assert _misfit(far, np.zeros((N, 0)), solver, far) <= RELATIVE
    assert _misfit(tangent, np.zeros((N, 0)), solver, symmetric) <= RELATIVE
    assert solver.factors == 2
    assert _misfit(tangent, np.zeros((N, 0)), TangentSolver(np.zeros((N, 0)), "superlu"), far) < 1e-10


def test_an_indefinite_tangent_is_solved_and_a_singular_one_is_named() -> None:
    tangent, symmetric = _system(0.1, shift=1.0)
    solver = TangentSolver(np.zeros((N, 0)), "auto")
    assert _misfit(tangent, np.zeros((N, 0)), solver, symmetric) <= RELATIVE
    singular = sp.csr_matrix((N, N))
    with pytest.raises(FemConvergenceError, match="singular"):
        _misfit(singular, np.zeros((N, 0)), TangentSolver(np.zeros((N, 0)), "superlu"), singular)
