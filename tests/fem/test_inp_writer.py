"""Models written as Abaqus and CalculiX input: what our own reader makes of them, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.inp_writer import nodal_loads, write_inp
from fem.loads import FollowerPressure
from fem.mesh import Mesh
from fem.model import Body, Model, Pair, Support, Tie, build_model
from fem.read_mesh import read_mesh
from tests.fem.small_models import STEEL, box, clamped_strip, distorted

_HALF_DIGIT = 0.5e-13  # of coordinates with 14 digits


def _stack(upper: Mesh, **joints: object) -> Model:
    lower = distorted(box((2.0, 1.0, 1.0), (3, 2, 2), "tet10", shift=-1.0), 0.02, boundary=False)
    bodies = [Body("lower", lower, STEEL), Body("upper", upper, STEEL, "linear")]
    return build_model(bodies, supports=[Support("lower.y_min", ("x", "y", "z"))], **joints)  # type: ignore[arg-type]


def _sorted(facets: np.ndarray) -> np.ndarray:
    """Facets by their smallest node numbers, so that the order of lines plays no part."""
    return facets[np.lexsort(np.sort(facets, axis=1).T)]


def test_round_trip_gives_the_same_bodies_and_surfaces(tmp_path: Path) -> None:
    upper = distorted(box((2.0, 1.0, 1.0), (2, 2, 3)), 0.02, boundary=False)
    upper = upper.with_region("corner", lambda x: (x < 0.3).all(axis=1))
    model = _stack(upper, pairs=[Pair("joint", "upper.y_min", "lower.y_max", 0.3)])
    path = tmp_path / "stack.inp"
    write_inp(path, model)
    for body in model.bodies:
        mesh, read = body.mesh, read_mesh(path, group=body.name)
        np.testing.assert_allclose(read.points, mesh.points, rtol=_HALF_DIGIT * 10, atol=0.0)
        np.testing.assert_array_equal(read.cells, mesh.cells)
        assert read.element == mesh.element
        assert mesh.surfaces
        for name, facets in mesh.surfaces.items():
            np.testing.assert_array_equal(_sorted(read.surface(f"{body.name}_{name}")), _sorted(facets))
        for name, nodes in mesh.node_sets.items():
            np.testing.assert_array_equal(read.nodes(f"{body.name}_{name}"), nodes)


def _block(text: str, keyword: str) -> list[str]:
    """The data lines behind the first line that starts with a keyword."""
    lines = text.splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith(keyword)) + 1
    return lines[first : next(n for n in range(first, len(lines) + 1) if n == len(lines) or lines[n][:1] == "*")]


def test_supports_materials_and_friction_are_those_of_the_model(tmp_path: Path) -> None:
    model = clamped_strip(friction=0.3)
    path = tmp_path / "strip.inp"
    write_inp(path, model)
    text = path.read_text()
    held = {(int(n) - 1) * 3 + int(axis) - 1 for n, axis in (line.split(",") for line in _block(text, "*BOUNDARY"))}
    assert held == set(np.flatnonzero(~model.free).tolist())
    assert [float(x) for x in _block(text, "*ELASTIC")[0].split(",")] == [200e9, 0.3]
    assert [float(x) for x in _block(text, "*DENSITY")] == [7800.0]
    normal, tangential, friction = model.contact.law[0]
    assert [float(x) for x in _block(text, "*SURFACE BEHAVIOR")] == pytest.approx([normal], rel=_HALF_DIGIT * 10)
    written = [float(x) for x in _block(text, "*FRICTION")[0].split(",")]
    assert written == pytest.approx([friction, tangential], rel=_HALF_DIGIT * 10)
    assert _block(text, "*CONTACT PAIR") == ["panel_y_min,support_y_max"]


def test_ties_are_written(tmp_path: Path) -> None:
    model = _stack(box((2.0, 1.0, 1.0), (2, 2, 3)), ties=[Tie("glue", "upper.y_min", "lower.y_max")])
    path = tmp_path / "tied.inp"
    write_inp(path, model)
    text = path.read_text()
    assert _block(text, "*TIE,NAME=glue") == ["upper_y_min,lower_y_max"]
    assert "*CONTACT PAIR" not in text


def test_nodal_loads_are_the_load() -> None:
    model = clamped_strip()
    load = np.zeros(model.n_dof)
    for line in nodal_loads(model.load).splitlines()[1:]:
        node, axis, force = line.split(",")
        load[3 * int(node) + int(axis) - 4] = float(force)
    np.testing.assert_allclose(load, model.load, rtol=_HALF_DIGIT * 10, atol=0.0)


def test_what_calculix_has_no_counterpart_for_is_refused(tmp_path: Path) -> None:
    model = build_model([Body("body", box((1.0, 1.0, 1.0), (1, 1, 1), "hex27"), STEEL)])
    with pytest.raises(FemInputError, match="this element is not written; got hex27"):
        write_inp(tmp_path / "hex27.inp", model)
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1))
    moved = build_model([Body("body", mesh, STEEL)], supports=[Support("body.x_min", ("x",), 1e-3)])
    pressed = build_model([Body("body", mesh, STEEL)], loads=[FollowerPressure("p", "body.x_min", 1.0)])
    with pytest.raises(FemInputError, match="follower pressures are not written"):
        write_inp(tmp_path / "pressed.inp", pressed)
    with pytest.raises(FemInputError, match="only supports at rest"):
        write_inp(tmp_path / "moved.inp", moved)
    stressed = build_model([Body("body", mesh, STEEL, initial_stress=1e6 * np.eye(3))])
    with pytest.raises(FemInputError, match="initial stress is not written"):
        write_inp(tmp_path / "stressed.inp", stressed)
