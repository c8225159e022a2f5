"""Sensors interpolate with the shape functions of their cell."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.model import Body, build_model
from fem.sensor import Sensor, sensor_rows
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
