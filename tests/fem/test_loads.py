"""Dead loads: resultant and moment of every kind, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.loads import Force, Gravity, Load, PointForce, Pressure, Traction
from fem.mesh import within
from fem.model import Body, Clamp, build_model
from tests.fem.small_models import STEEL, box

ELEMENTS = ("hex20", "hex27", "tet10")
NAN = float("nan")


def _nodal(load: Load, element: str = "hex20") -> tuple[np.ndarray, np.ndarray]:
    """Points and nodal forces (n_node, 3) of one load on a box of 0.3 x 0.2 x 0.1 m."""
    mesh = box((0.3, 0.2, 0.1), (3, 2, 2), element)
    mesh = mesh.with_region("pair", lambda x: (np.abs(x[:, 0]) < 1e-9) & (np.abs(x[:, 1]) < 1e-9) & (x[:, 2] != 0.05))
    model = build_model([Body("beam", mesh, STEEL)], loads=[load])
    return model.points, model.load.reshape(-1, 3)


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize(
    ("load", "resultant", "centre"),
    [
        (Traction("t", "beam.x_max", (0.0, 3e4, 1e4)), (0.0, 600.0, 200.0), (0.3, 0.1, 0.05)),
        (Traction("t", "beam.x_max&y_max", (0.0, 3e3, 0.0)), (0.0, 300.0, 0.0), (0.3, 0.2, 0.05)),
        (Force("f", "beam.y_max", (5.0, -7.0, 2.0)), (5.0, -7.0, 2.0), (0.15, 0.2, 0.05)),
        (Force("f", "beam.x_max&z_min", (5.0, -7.0, 2.0)), (5.0, -7.0, 2.0), (0.3, 0.1, 0.0)),
        (Force("f", "beam.x_max&y_max&z_max", (5.0, -7.0, 2.0)), (5.0, -7.0, 2.0), (0.3, 0.2, 0.1)),
        (PointForce("p", (0.11, 0.07, 0.02), (5.0, -7.0, 2.0)), (5.0, -7.0, 2.0), (0.11, 0.07, 0.02)),
        (Gravity("g", (0.0, -9.81, 0.0)), (0.0, -9.81 * 7800.0 * 0.006, 0.0), (0.15, 0.1, 0.05)),
        (Clamp("c", "beam.x_max", 40.0), (-40.0, 0.0, 0.0), (0.3, 0.1, 0.05)),
        (Pressure("p", "beam.x_max", 2e3), (-40.0, 0.0, 0.0), (0.3, 0.1, 0.05)),
    ],
)
def test_load_has_its_resultant_and_centre(
    element: str, load: Load, resultant: tuple[float, ...], centre: tuple[float, ...]
) -> None:
    points, force = _nodal(load, element)
    size = np.abs(force).sum()
    np.testing.assert_allclose(force.sum(axis=0), resultant, atol=1e-12 * size)
    np.testing.assert_allclose(np.cross(points, force).sum(axis=0), np.cross(centre, resultant), atol=1e-12 * size)


def test_line_load_of_an_edge_is_one_four_one_per_edge() -> None:
    """A uniform load on a three-node edge: 1/6, 2/3, 1/6 of its total (two edges here)."""
    points, force = _nodal(Force("f", "beam.x_max&y_max", (0.0, 12.0, 0.0)))
    line = np.flatnonzero(force[:, 1])
    order = line[points[line, 2].argsort()]
    assert force[order, 1] == pytest.approx([1.0, 4.0, 2.0, 4.0, 1.0], abs=1e-12)


def test_force_on_loose_nodes_is_shared_equally() -> None:
    _, force = _nodal(Force("f", "beam.pair", (0.0, 12.0, 0.0)))
    loaded = np.flatnonzero(force[:, 1])
    assert len(loaded) == 4
    assert force[loaded, 1] == pytest.approx(3.0)


def test_gravity_acts_on_the_named_bodies_only() -> None:
    bodies = [Body(name, box((1.0, 1.0, 1.0), (1, 1, 1), shift=shift), STEEL) for name, shift in (("a", 0), ("b", 2))]
    model = build_model(bodies, loads=[Gravity("g", (0.0, 0.0, 2.0), ("b",))])
    np.testing.assert_array_equal(model.load.reshape(-1, 3)[:20], 0.0)
    assert model.load.reshape(-1, 3)[20:].sum(axis=0) == pytest.approx([0.0, 0.0, 2.0 * 7800.0])


def test_clamps_and_loads_add_up() -> None:
    body = Body("beam", box((0.3, 0.2, 0.1), (1, 1, 1)), STEEL)
    model = build_model([body], clamps=[Clamp("c", "beam.x_max", 4.0)], loads=[Gravity("g", (1.0, 0.0, 0.0))])
    assert model.loads.shape == (2, model.n_dof)
    np.testing.assert_array_equal(model.load, model.loads.sum(axis=0))


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (Traction("t", "beam.top", (0.0, 1.0, 0.0)), "unknown surface or node set"),
        (Traction("t", "plate.x_max", (0.0, 1.0, 0.0)), "unknown surface"),
        (Traction("t", "beam.pair", (0.0, 1.0, 0.0)), "neither a surface nor a line"),
        (Traction("t", "beam.x_max", (0.0, NAN, 0.0)), "load t: the load is not finite"),
        (Clamp("c", "beam.x_max", NAN), "load c: the load is not finite"),
        (PointForce("p", (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "load p: the point lies outside"),
        (PointForce("p", (NAN, 0.0, 0.0), (1.0, 0.0, 0.0)), "load p: "),
        (Gravity("g", (0.0, 0.0, -9.81), ("plate",)), "unknown body"),
    ],
)
def test_loads_that_make_no_sense_are_refused(load: Load, message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        _nodal(load)


def test_region_helper_keeps_the_margin_small() -> None:
    inside = within(x=(0.0, 0.1))
    np.testing.assert_array_equal(
        inside(np.array([[0.0, 0, 0], [0.1 + 1e-8, 0, 0], [0.101, 0, 0], [1.0, 0, 0]])), [True, True, False, False]
    )
