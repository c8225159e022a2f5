"""Continuation on curves whose folds, Hopf and branch points are known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.branch import ContinuationSettings
from romgen.continuation import continue_branch, solve_at, switch_branch
from romgen.errors import NumericalError

Linearisation = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Equilibria:
    """x' = F(x, p), multipliers over unit time."""

    field: Callable[[FloatArray, float], Linearisation]

    def linearise(self, x: FloatArray, p: float) -> Linearisation:
        return self.field(x, p)

    def multipliers(self, x: FloatArray, p: float) -> ComplexArray:
        return np.exp(np.linalg.eigvals(self.field(x, p)[1]).astype(np.complex128))


def cubic(x: FloatArray, p: float) -> Linearisation:
    """p = x^3 - x: folds at x = +-1/sqrt(3), p = -+2/(3 sqrt(3)); stable for x' = p + x - x^3 outside."""
    return p + x - x**3, np.diag(1.0 - 3.0 * x**2), np.ones(1)


def circle(x: FloatArray, p: float) -> Linearisation:
    return x**2 + p**2 - 1.0, np.diag(2.0 * x), np.array([2.0 * p])


def pitchfork(x: FloatArray, p: float) -> Linearisation:
    return p * x - x**3, np.diag(p - 3.0 * x**2), x.copy()


def hopf(x: FloatArray, p: float) -> Linearisation:
    """Rotation with growth p - 0.123 - abs(x)^2, beside a decaying third state."""
    growth, r = p - 0.123, x[:2]
    J = np.zeros((3, 3))
    J[:2, :2] = np.array([[growth, -1.0], [1.0, growth]]) - (r @ r) * np.eye(2) - 2.0 * np.outer(r, r)
    J[2, 2] = -1.0
    F = np.append(np.array([[growth, -1.0], [1.0, growth]]) @ r - (r @ r) * r, -x[2])
    return F, J, np.append(r, 0.0)


def neutral_saddle(x: FloatArray, p: float) -> Linearisation:
    """Eigenvalues 1 and -1 + p: their sum vanishes at p = 0 without a Hopf point."""
    J = np.diag([1.0, -1.0 + p])
    return J @ x, J, np.array([0.0, x[1]])


def test_folds_of_the_cubic() -> None:
    branch = continue_branch(Equilibria(cubic), np.array([-2.0]), -6.0, ContinuationSettings((-6.0, 6.0)))
    p_fold = 2.0 / (3.0 * np.sqrt(3.0))
    folds = branch.located("fold")
    # the fold parameter has zero slope along the branch: 1e-12 in arclength is far below rounding of p
    np.testing.assert_allclose([fold.p for fold in folds], [p_fold, -p_fold], rtol=1e-9)
    np.testing.assert_allclose(
        branch.x[[fold.index for fold in folds], 0], [-1 / np.sqrt(3), 1 / np.sqrt(3)], rtol=1e-6
    )
    assert branch.ends == ("range", "range")
    assert branch.p[0] == pytest.approx(-6.0)
    assert branch.p[-1] == pytest.approx(6.0)


def test_every_point_solves_and_stability_changes_at_the_folds() -> None:
    branch = continue_branch(Equilibria(cubic), np.array([-2.0]), -6.0, ContinuationSettings((-6.0, 6.0)))
    np.testing.assert_allclose(branch.p + branch.x[:, 0] - branch.x[:, 0] ** 3, 0.0, atol=1e-12)
    clear = np.abs(np.abs(branch.x[:, 0]) - 1.0 / np.sqrt(3.0)) > 1e-6
    np.testing.assert_array_equal(branch.stable[clear], np.abs(branch.x[clear, 0]) > 1.0 / np.sqrt(3.0))


def test_start_inside_runs_in_both_directions() -> None:
    branch = continue_branch(Equilibria(cubic), np.array([0.0]), 0.0, ContinuationSettings((-6.0, 6.0)))
    assert {round(float(p), 9) for p in branch.p[[0, -1]]} == {-6.0, 6.0}
    assert len(branch.located("fold")) == 2


def test_closed_curve_ends_where_it_began() -> None:
    branch = continue_branch(Equilibria(circle), np.array([0.8]), 0.6, ContinuationSettings((-2.0, 2.0)))
    assert branch.ends == ("closed", "closed")
    np.testing.assert_allclose(branch.x[-1], branch.x[0])
    assert sorted(round(fold.p, 9) for fold in branch.located("fold")) == [-1.0, 1.0]


def test_hopf_point() -> None:
    branch = continue_branch(Equilibria(hopf), np.zeros(3), -1.0, ContinuationSettings((-1.0, 1.0)))
    (point,) = branch.located("torus")
    assert point.p == pytest.approx(0.123, abs=1e-10)
    np.testing.assert_array_equal(branch.stable[branch.p < 0.1229], True)
    np.testing.assert_array_equal(branch.stable[branch.p > 0.1231], False)


def test_neutral_saddle_is_no_hopf_point() -> None:
    branch = continue_branch(Equilibria(neutral_saddle), np.zeros(2), -0.5, ContinuationSettings((-0.5, 0.5)))
    assert branch.special == ()


def test_branch_point_and_switching() -> None:
    settings = ContinuationSettings((-1.0, 1.0))
    branch = continue_branch(Equilibria(pitchfork), np.zeros(1), -1.0, settings)
    (point,) = branch.located("branch_point")
    assert point.p == pytest.approx(0.0, abs=1e-9)
    x, p = switch_branch(Equilibria(pitchfork), branch.x[point.index], point.p, settings, distance=0.1)
    assert abs(x[0]) == pytest.approx(0.1)
    assert p == pytest.approx(0.01)


def test_state_limit_ends_the_branch() -> None:
    branch = continue_branch(
        Equilibria(cubic), np.array([-2.0]), -6.0, ContinuationSettings((-10.0, 10.0), state_limit=1.5)
    )
    assert "limit" in branch.ends


def test_failed_start_carries_its_history() -> None:
    def nowhere(x: FloatArray, p: float) -> Linearisation:
        return x**2 + 1.0, np.diag(2.0 * x), np.ones(1)

    with pytest.raises(NumericalError, match="did not converge") as failure:
        continue_branch(Equilibria(nowhere), np.array([0.7]), 0.0, ContinuationSettings((-1.0, 1.0)))
    assert len(failure.value.history) == ContinuationSettings((-1.0, 1.0)).iterations


def test_scales_do_not_change_the_folds() -> None:
    settings = ContinuationSettings((-6.0, 6.0), state_scale=0.3, parameter_scale=2.0)
    branch = continue_branch(Equilibria(cubic), np.array([-2.0]), -6.0, settings)
    np.testing.assert_allclose([fold.p for fold in branch.located("fold")], np.array([1, -1]) * 2 / 27**0.5, rtol=1e-9)


def test_solution_at_fixed_parameter() -> None:
    x = solve_at(Equilibria(cubic), np.array([2.0]), 6.0, ContinuationSettings((-9.0, 9.0)))
    assert x[0] == pytest.approx(2.0, rel=1e-12)
