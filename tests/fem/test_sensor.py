"""Sensors interpolate with the shape functions of their cell; points where bodies touch name theirs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.excitation import time_load
from fem.model import Body, Model, PointForce, PointMass, Spring, build_model
from fem.sensor import Sensor, SensorWarning, sensor_rows
from fem.stress import point_stress
from tests.fem.small_models import STEEL, box, distorted, single


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_linear_fields_are_read_exactly(element: str) -> None:
    model = single(distorted(box((1.0, 0.8, 0.6), (2, 2, 2), element), 0.04, boundary=False))
    gradient, offset = np.random.default_rng(1).standard_normal((3, 3)), np.array([0.1, -0.2, 0.3])
    u = (model.points @ gradient.T + offset).ravel()
    places = np.random.default_rng(2).uniform(0.05, 0.55, (6, 3))
    sensors = [Sensor(f"{i}{axis}", tuple(p), axis) for i, p in enumerate(places) for axis in "xyz"]
    rows = sensor_rows(model, sensors)
    np.testing.assert_allclose(rows @ u, (places @ gradient.T + offset).ravel(), atol=1e-12)
    np.testing.assert_allclose(rows.sum(axis=1), 1.0, atol=1e-13)


def test_sensor_at_a_node_reads_that_node_of_the_right_body() -> None:
    lower = Body("lower", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL)
    upper = Body("upper", box((1.0, 1.0, 1.0), (1, 1, 1), shift=2.0), STEEL)
    model = build_model([lower, upper])
    row = sensor_rows(model, [Sensor("top", (0.0, 3.0, 0.5), "z")])[0]
    (dof,) = np.flatnonzero(np.abs(row) > 1e-12)
    np.testing.assert_allclose(model.points[dof // 3], [0.0, 3.0, 0.5], atol=1e-15)
    assert dof % 3 == 2
    assert row[dof] == pytest.approx(1.0, abs=1e-13)


def test_point_outside_names_the_nearest_node() -> None:
    model = single(box((1.0, 1.0, 1.0), (1, 1, 1)))
    with pytest.raises(FemInputError, match=r"sensor far: .*nearest node is at \(1.0, 1.0, 1.0\)"):
        sensor_rows(model, [Sensor("far", (1.2, 1.1, 1.1), "x")])


def test_unknown_direction_is_refused() -> None:
    model = single(box((1.0, 1.0, 1.0), (1, 1, 1)))
    with pytest.raises(FemInputError, match="sensor tip"):
        sensor_rows(model, [Sensor("tip", (0.5, 0.5, 0.5), "radial")])


def _touching() -> Model:
    """Two unit cubes that touch at y = 1, the second with moving nodes of its own."""
    lower = Body("lower", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL)
    upper = Body("upper", box((1.0, 1.0, 1.0), (2, 1, 2), shift=1.0), STEEL)
    return build_model([lower, upper])


TOUCH = (0.5, 1.0, 0.5)


@pytest.mark.parametrize(("body", "start", "stop"), [("lower", 0, 20), ("upper", 20, 71)])
def test_a_point_where_bodies_touch_is_on_the_one_named(body: str, start: int, stop: int) -> None:
    """All that takes a point: sensors, forces, stresses, masses, springs."""
    model = _touching()
    assert (int(model.offsets[1]), len(model.points)) == (20, 71)
    own = slice(3 * start, 3 * stop)
    row = sensor_rows(model, [Sensor("s", TOUCH, "y", body)])[0]
    force = time_load(model, PointForce("f", TOUCH, (0.0, 1.0, 0.0), body), lambda t: 1.0).pattern
    for vector in (row, force):
        assert vector[own].sum() == pytest.approx(1.0, abs=1e-12)
        assert np.abs(vector).sum() == pytest.approx(np.abs(vector[own]).sum(), abs=1e-12)
    np.testing.assert_allclose(row, force, atol=1e-15)
    extra = build_model(model.bodies, point_masses=[PointMass("m", TOUCH, 2.0, body)]).mass - model.mass
    assert abs(extra[own, own]).sum() == pytest.approx(abs(extra).sum(), rel=1e-12)
    assert build_model(model.bodies, point_masses=[PointMass("m", TOUCH, 2.0, body)]).lumped_mass()[own].sum() > (
        model.lumped_mass()[own].sum() + 5.999
    )
    u = np.zeros((len(model.points), 3))
    u[start:stop, 1] = 1e-6 * model.points[start:stop, 1]
    stress = point_stress(model, u.ravel(), [TOUCH], body=body).cauchy[0, 1, 1]
    other = {"lower": "upper", "upper": "lower"}[body]
    assert stress > 1e5
    assert point_stress(model, u.ravel(), [TOUCH], body=other).cauchy[0, 1, 1] == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("make", [
    lambda model: time_load(model, PointForce("at", TOUCH, (0.0, 1.0, 0.0)), lambda t: 1.0),
    lambda model: point_stress(model, np.zeros(model.n_dof), [TOUCH]),
    lambda model: build_model(model.bodies, point_masses=[PointMass("at", TOUCH, 1.0)]),
    lambda model: build_model(model.bodies, springs=[Spring("at", TOUCH, (1.0, 1.0, 1.0))]),
    lambda model: build_model(model.bodies, springs=[Spring("at", (0.5, 0.5, 0.5), (1.0, 1.0, 1.0), to=TOUCH)]),
], ids=["force", "stress", "mass", "spring", "second end"])  # fmt: skip
def test_a_point_of_two_bodies_needs_a_name(make: Callable[[Model], object]) -> None:
    with pytest.raises(FemInputError, match=r"lies on several bodies; .*name one: body = 'lower' or 'upper'"):
        make(_touching())


def test_a_sensor_of_two_bodies_measures_the_first_and_says_so() -> None:
    model = _touching()
    message = "sensor at lies on lower and upper and measures lower; name its body if another is meant"
    with pytest.warns(SensorWarning, match=message):
        rows = sensor_rows(model, [Sensor("at", TOUCH, "y")])
    np.testing.assert_array_equal(rows, sensor_rows(model, [Sensor("at", TOUCH, "y", "lower")]))


def test_unknown_and_wrong_bodies_are_named() -> None:
    model = _touching()
    with pytest.raises(FemInputError, match="sensor a: unknown body; got middle; bodies are lower, upper"):
        sensor_rows(model, [Sensor("a", TOUCH, "y", "middle")])
    with pytest.raises(FemInputError, match=r"sensor a: the point lies outside upper; .*nearest node is at \(0.5, 1.0"):
        sensor_rows(model, [Sensor("a", (0.5, 0.5, 0.5), "y", "upper")])


def test_a_spring_between_touching_points_acts() -> None:
    """It pulls the two bodies together along y by k times their distance; with both ends on one it is refused."""
    model = _touching()
    between = Spring("joint", TOUCH, (0.0, 1e6, 0.0), to=TOUCH, body="lower", to_body="upper")
    sprung = build_model(model.bodies, springs=[between])
    u = np.zeros((len(model.points), 3))
    u[20:, 1] = 1e-3
    assert sprung.springs.forces(u.ravel())["joint"] == pytest.approx([0.0, 1e3, 0.0], rel=1e-12)
    with pytest.raises(FemInputError, match="spring joint: both ends are the same point"):
        build_model(model.bodies, springs=[replace(between, to_body="lower")])
    with pytest.raises(FemInputError, match="spring joint: to_body without a point to"):
        build_model(model.bodies, springs=[replace(between, to=None)])
