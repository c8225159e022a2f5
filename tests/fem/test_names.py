"""Names of bodies, surfaces and parts: who asks, what is near, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.names import nearest
from tests.fem.small_models import STEEL, blocks, box

BODY = fem.Body("beam", box((0.3, 0.1, 0.1), (2, 1, 1)), STEEL)
LINE = replace(BODY, mesh=BODY.mesh.with_region("line", fem.within(x=(0.0, 0.0), y=(0.0, 0.0))))
AXES = ("x", "y", "z")
ONE = (1.0, 0.0, 0.0)


def _model(**parts: object) -> fem.Model:
    return fem.build_model([LINE], **parts)


def _pair(slave: str, master: str) -> fem.Model:
    model = blocks()
    return fem.build_model(model.bodies, pairs=[fem.Pair("seam", slave, master, 0.1)])


HELD = _model(supports=[fem.Support("beam.x_min", AXES)])
REST = fem.rest_state(HELD)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: _model(supports=[fem.Support("beam.top", AXES)]), "^support beam.top: unknown surface or node set"),
        (lambda: _model(supports=[fem.Support("beam.x_min&top", AXES)]), "^support beam.x_min&top: unknown"),
        (lambda: _model(supports=[fem.Support("beam.x_min&x_max", AXES)]), "^support .*: no node belongs to this set"),
        (lambda: _model(supports=[fem.Support("beam.line", ("normal",))]), "^support beam.line: not a surface"),
        (lambda: _model(loads=[fem.Force("pull", "plate.x_max", ONE)]), "^load pull: .*with the bodies beam"),
        (lambda: _model(loads=[fem.Traction("pull", "beam.top", ONE)]), "^load pull: unknown"),
        (lambda: _model(loads=[fem.Pressure("gas", "beam.line", 1.0)]), "^load gas: a set of nodes is no surface"),
        (lambda: _model(loads=[fem.Force("pull", 3, ONE)]), "^load pull: unknown"),
        (lambda: _model(clamps=[fem.Clamp("screw", "beam.top", 1.0)]), "^load screw: unknown surface; got top"),
        (lambda: _model(springs=[fem.Foundation("bed", "beam.top")]), "^spring bed: unknown surface; got top"),
        (lambda: _pair("upper.bottom", "lower.y_max"), "^joint seam: unknown surface; got bottom; .* on body upper"),
        (lambda: _pair("upper.y_min", "lower.top"), "^joint seam: unknown surface; got top; .* on body lower"),
        (lambda: fem.reaction(HELD, REST, "beam.top"), "^reaction of beam.top: unknown"),
        (lambda: fem.support_motion(HELD, "beam.top", ("x",), lambda t: t), "^motion of beam.top: unknown"),
        (lambda: HELD.facets("beam.line"), "^facets: a set of nodes is no surface"),
    ],
)
def test_errors_say_who_asked(make: Callable[[], object], message: str) -> None:
    with pytest.raises(fem.FemInputError, match=message):
        make()


def test_nearest_names_of_many() -> None:
    """Up to twelve names are all listed, of more those most like the wrong one."""
    assert nearest("b", ["b_1", "a"], "known are") == "known are a, b_1"
    assert nearest("b", [], "known are") == "known are none"
    faces = [f"surface_{n}" for n in range(40)] + ["flange_top"]
    said = nearest("flange.top", faces, "known are")
    assert said.startswith("nearest of 41 names: flange_top, ")
    assert said.count(",") == 5


@pytest.mark.parametrize("name", ["", "part.1", 7])
def test_bodies_whose_names_cannot_be_used(name: object) -> None:
    with pytest.raises(fem.FemInputError, match=r"not a name for a body.*without a dot"):
        fem.Body(name, BODY.mesh, STEEL)


def test_nodes_without_a_cell_are_refused() -> None:
    """Nothing would hold them: the matrix would be singular."""
    mesh = BODY.mesh
    loose = fem.Mesh(np.vstack([mesh.points, [[1.0, 2.0, 3.0]]]), mesh.cells, mesh.element, mesh.surfaces)
    with pytest.raises(fem.FemInputError, match=rf"body beam: nodes belong to no cell; got node {len(mesh.points)} at"):
        fem.Body("beam", loose, STEEL)


def test_a_name_with_an_ampersand_is_found_as_it_is() -> None:
    mesh = BODY.mesh.with_region("in&out", fem.within(x=(0.3, 0.3)))
    model = fem.build_model([replace(BODY, mesh=mesh)], supports=[fem.Support("beam.in&out", AXES)])
    assert (~model.free).sum() == 3 * len(mesh.nodes("x_max"))


def test_joints_of_one_name_are_refused() -> None:
    """Reports and histories go by name."""
    model = blocks()
    tie = fem.Tie("joint", "upper.y_min", "lower.y_max")
    with pytest.raises(fem.FemInputError, match="joints of the same name; got joint"):
        fem.build_model(model.bodies, pairs=model.pairs, ties=[tie])
