"""Supports on surfaces, lines and points, planes of symmetry, prescribed displacements."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.material import Material
from fem.mesh import Mesh, within
from fem.model import Body, Model, Support, build_model
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import STEEL, box

MESH = box((0.3, 0.2, 0.1), (2, 2, 2)).with_region("mid_line", within(y=(0.1, 0.1), x=(0.0, 0.0)))
SETTINGS = StaticSettings(steps=2, tolerance=1e-9, solver="superlu")


def _model(*supports: Support, mesh: Mesh = MESH, kinematics: str = "green_lagrange") -> Model:
    return build_model([Body("beam", mesh, STEEL, kinematics)], supports=supports)


def _held(model: Model) -> set[tuple[float, ...]]:
    """Points that are held in any direction."""
    return {tuple(p) for p in model.points[~model.free.reshape(-1, 3).all(axis=1)].round(9)}


def test_two_faces_name_their_edge_and_three_their_corner() -> None:
    z = (0.0, 0.025, 0.05, 0.075, 0.1)
    assert _held(_model(Support("beam.x_min&y_max", ("y",)))) == {(0.0, 0.2, c) for c in z}
    assert _held(_model(Support("beam.x_min&y_max&z_min", ("y",)))) == {(0.0, 0.2, 0.0)}
    assert _held(_model(Support("beam.mid_line", ("x", "y")))) == {(0.0, 0.1, c) for c in z}


def test_region_of_whole_faces_is_a_surface_too() -> None:
    mesh = MESH.with_region("pad", within(x=(0.15, 0.3), y=(0.2, 0.2)))
    assert len(mesh.surface("pad")) == 2
    assert np.all(mesh.points[mesh.surface("pad")][..., 1] == 0.2)
    with pytest.raises(FemInputError, match="region nowhere"):
        MESH.with_region("nowhere", within(x=(1.0, 2.0)))


def test_normal_direction_is_a_plane_of_symmetry() -> None:
    held = ~_model(Support("beam.y_min", ("normal",))).free.reshape(-1, 3)
    np.testing.assert_array_equal(held[:, 1], MESH.points[:, 1] == 0.0)
    assert not held[:, [0, 2]].any()
    turned = Mesh(MESH.points @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]), *_rest(MESH))
    with pytest.raises(FemInputError, match="plane across an axis"):
        _model(Support("beam.y_min", ("normal",)), mesh=turned)


def _rest(mesh: Mesh) -> tuple[np.ndarray, str, dict[str, np.ndarray], dict[str, np.ndarray]]:
    return mesh.cells, mesh.element, mesh.surfaces, mesh.node_sets


@pytest.mark.parametrize("kinematics", ["linear", "green_lagrange"])
def test_prescribed_displacement_stretches_a_bar(kinematics: str) -> None:
    """Uniaxial stretch 1.1, nu = 0: reaction E A eps, or E A lambda (lambda^2 - 1)/2 with Green-Lagrange strain."""
    body = Body("bar", box((0.3, 0.2, 0.1), (2, 1, 1)), Material(1e9, 0.0, 1.0), kinematics)
    supports = [Support(f"bar.{side}_min", ("normal",)) for side in "xyz"]
    model = build_model([body], supports=[*supports, Support("bar.x_max", ("x",), 0.03)])
    state = solve_static(model, model.load, SETTINGS)
    assert state.u.reshape(-1, 3)[body.mesh.nodes("x_max")] == pytest.approx(
        np.tile([0.03, 0.0, 0.0], (len(body.mesh.nodes("x_max")), 1)), abs=1e-10
    )
    reaction = model.elastic_force(state.u[:, None])[0][:, 0].reshape(-1, 3)[body.mesh.nodes("x_max"), 0].sum()
    strain = 0.1 if kinematics == "linear" else 1.1 * (1.1**2 - 1.0) / 2.0
    assert reaction == pytest.approx(1e9 * 0.02 * strain, rel=1e-8)


def test_prescribed_rigid_motion_leaves_no_stress() -> None:
    """All of the skin turned by 40 degrees: the inside follows without energy (1e-8 of E V, the tolerance)."""
    c, s = np.cos(np.deg2rad(40.0)), np.sin(np.deg2rad(40.0))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    model = _model(Support("beam.skin", ("x", "y", "z"), lambda x: x @ (turn - np.eye(3)).T))
    state = solve_static(model, model.load, StaticSettings(steps=4, tolerance=1e-10, solver="superlu"))
    np.testing.assert_allclose(state.u, (model.points @ (turn - np.eye(3)).T).ravel(), atol=1e-9)
    assert model.elastic_force(state.u[:, None])[1][0] < 1e-8 * STEEL.young_modulus * 0.006


@pytest.mark.parametrize(
    ("supports", "message"),
    [
        ([Support("beam.x_min&x_max", ("x",))], "no node"),
        ([Support("beam.middle", ("x",))], "known surfaces: mid_line, x_max"),
        ([Support("beam.x_min", ("radial",))], "choose x, y, z or normal"),
        ([Support("beam.x_min", ("x",), float("nan"))], "not finite"),
        ([Support("beam.x_min", ("x",), (0.0, 1.0))], "one number or one for each"),
        ([Support("beam.x_min", ("x",), lambda x: x[:, 0])], "not a displacement field"),
        ([Support("beam.x_min", ("x",)), Support("beam.y_min", ("x",), 1e-3)], "two different displacements"),
    ],
)
def test_supports_that_make_no_sense_are_refused(supports: list[Support], message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        _model(*supports)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": MESH.points * np.nan}, "not finite"),
        ({"cells": MESH.cells + 5}, "missing nodes"),
        ({"cells": MESH.cells[:, :8]}, "not a table of cells"),
        ({"cells": MESH.cells[:0]}, "not a table of cells"),
    ],
)
def test_meshes_that_cannot_be_are_refused(change: dict[str, np.ndarray], message: str) -> None:
    parts = {"points": MESH.points, "cells": MESH.cells} | change
    with pytest.raises(FemInputError, match=message):
        Mesh(parts["points"], parts["cells"], "hex20", {})
