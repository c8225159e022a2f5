"""Equilibrium paths through limit points: two-bar truss of solids, and a shallow arch against displacement control."""

from __future__ import annotations

import numpy as np
import pytest

from fem.arc_length import EquilibriumPath, PathSettings, follow_path
from fem.block import graded, hex_block
from fem.errors import FemConvergenceError
from fem.material import Material
from fem.mesh import within
from fem.model import Body, Force, Model, Support, build_model
from fem.preload import StaticSettings, solve_static

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
