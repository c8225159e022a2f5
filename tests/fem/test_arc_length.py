"""Equilibrium paths through limit points: two-bar truss of solids, and a shallow arch against displacement control."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from fem.arc_length import EquilibriumPath, PathSettings, follow_path
from fem.block import graded, hex_block
from fem.errors import FemConvergenceError
from fem.material import Material
from fem.mesh import within
from fem.model import Body, Force, Model, Support, build_model
from fem.preload import StaticSettings, solve_static
from fem.stability import unstable_directions

RISE, SPAN = 0.03, 1.0


def _arch(*, top: float | None = None) -> Model:
    """Half of a shallow arch between immovable hinges, pushed down at the crown, or moved there by ``top`` m."""
    mesh = hex_block(
        graded([0.0, 0.5 * SPAN], [8]),
        graded([0.0, 0.02], [1]),
        graded([0.0, 0.05], [1]),
        mapping=lambda p: p + np.outer(RISE * np.cos(np.pi * p[:, 0] / SPAN), [0.0, 1.0, 0.0]),
    )
    mesh = mesh.with_region("hinge", within(x=(0.5 * SPAN, 0.5 * SPAN), y=(0.01, 0.01)))
    supports = [Support("arch.hinge", ("x", "y")), Support("arch.x_min", ("x",)), Support("arch.z_min", ("z",))]
    if top is not None:
        supports.append(Support("arch.x_min&y_max", ("y",), top))
    loads = [Force("push", "arch.x_min&y_max", (0.0, -1.0, 0.0))] if top is None else []
    return build_model([Body("arch", mesh, Material(1e9, 0.0, 1.0))], supports=supports, loads=loads)


def _sag(model: Model, u: np.ndarray) -> float:
    return -float(u.reshape(-1, 3)[model.bodies[0].mesh.nodes("x_min&y_max"), 1].mean())


def _path(model: Model) -> EquilibriumPath:
    settings = PathSettings(step=0.1, largest_step=0.5, solver="superlu")
    return follow_path(model, 100.0 * model.load, settings, stop=lambda u, _: _sag(model, u) > 2.0 * RISE)


def test_arch_snaps_through_on_the_path_that_displacement_control_finds() -> None:
    """Loads on the path, past both limit points, are the reactions at the same prescribed sag; Newton tolerance 1e-8.

    The crown line moves evenly (one cell across, symmetric), so that a force spread over it and a prescribed line
    displacement differ by less than 1e-3 of the load.
    """
    model = _arch()
    path = _path(model)
    assert len(path.limit_points) == 2
    first, last = path.limit_points
    assert path.load_factors[first] > 0.0 > path.load_factors[last]
    largest = path.load_factors[first]
    assert np.all(path.load_factors[:last] <= largest * (1.0 + 1e-9))
    for number in (2, (first + last) // 2, len(path.load_factors) - 2):
        sag = _sag(model, path.displacements[number])
        driven = _arch(top=-sag)
        nodes = driven.bodies[0].mesh.nodes("x_min&y_max")
        # The same start as the path, so that the prescribed line finds the branch that the path is on.
        state = solve_static(driven, driven.load, StaticSettings(12, 1e-8, 40, "superlu"))
        reaction = driven.elastic_force(state.u[:, None])[0][:, 0].reshape(-1, 3)[nodes, 1].sum()
        assert -reaction == pytest.approx(100.0 * path.load_factors[number], abs=1e-3 * 100.0 * largest)


def test_path_points_are_equilibria_and_rates_change_sign_at_limits() -> None:
    model = _arch()
    path = _path(model)
    for u, factor in zip(path.displacements, path.load_factors, strict=True):
        residual = np.where(model.free, 100.0 * factor * model.load - model.elastic_force(u[:, None])[0][:, 0], 0.0)
        assert np.linalg.norm(residual) < 1e-8 * 100.0 * np.linalg.norm(model.load)
    np.testing.assert_array_equal(path.displacements[:, ~model.free], 0.0)
    for limit in path.limit_points:
        assert abs(path.rates[limit]) < 1e-3
        assert path.rates[limit - 1] * path.rates[limit + 1] < 0.0


def test_path_that_does_not_end_keeps_what_it_found() -> None:
    model = _arch()
    settings = PathSettings(step=0.1, max_steps=3, solver="superlu")
    with pytest.raises(FemConvergenceError, match="did not reach its end") as caught:
        follow_path(model, 100.0 * model.load, settings, stop=lambda u, _: False)
    assert isinstance(caught.value.last_good, EquilibriumPath)
    assert len(caught.value.last_good.load_factors) >= 4


def test_path_without_load_is_refused() -> None:
    model = _arch()
    with pytest.raises(FemConvergenceError, match="positive size"):
        follow_path(model, 0.0 * model.load)


@pytest.mark.parametrize("share", [1e-3, 1e-6])
def test_slender_column_follows_koiter_and_the_elastica(share: float) -> None:
    """A clamped column of slenderness 690 with its first mode as imperfection a = share L, by default settings.

    w = a lambda / (1 - lambda) as long as rotations are small, (P/P_E) = (2 K(k)/pi)^2 at w/L = 2 k/K(k) when the
    imperfection no longer matters; twenty cells bend by 0.6 % too stiffly at w = L/2. It took 200 steps to w = L/10.
    """
    length, width, depth = 0.5, 0.01, 0.005
    mesh = hex_block(
        graded([0.0, length], [20]),
        graded([0.0, width], [1]),
        graded([-0.5 * depth, 0.5 * depth], [1]),
        mapping=lambda p: (
            p + np.outer(share * length * (1.0 - np.cos(0.5 * np.pi * p[:, 0] / length)), [0.0, 0.0, 1.0])
        ),
    )
    model = build_model(
        [Body("column", mesh, Material(2e11, 0.0, 7800.0))],
        supports=[Support("column.x_min", ("x", "y", "z")), Support("column.y_min", ("y",))],
        loads=[Force("push", "column.x_max", (-1.0, 0.0, 0.0))],
    )
    euler = np.pi**2 * 2e11 * width * depth**3 / 12.0 / (4.0 * length**2)
    tip = 3 * model.bodies[0].mesh.nodes("x_max&z_max")[0] + 2
    path = follow_path(model, 2.0 * euler * model.load, stop=lambda u, _: u[tip] > 0.5 * length)
    w, load = path.displacements[:, tip] / length, 2.0 * path.load_factors
    assert len(w) < 60
    early = (load > 0.3) & (load < 0.9)
    assert w[early] == pytest.approx(share * load[early] / (1.0 - load[early]), rel=0.05)
    late = w > max(0.1, 100.0 * share)
    k = np.array([brentq(lambda k, at=at: 2.0 * k / ellipk(k * k) - at, 1e-6, 0.95) for at in w[late]])
    assert load[late] == pytest.approx((2.0 * ellipk(k * k) / np.pi) ** 2, rel=6e-3 + share / 0.1)
    assert late.sum() >= 3
    assert [unstable_directions(model, state) for state in path.states[::6]] == [0] * len(path.states[::6])
