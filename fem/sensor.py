"""Sensors: one displacement component at a material point."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.locate_point import bodies_at_point, cell_of_point
from fem.model import AXES, Model


class SensorWarning(UserWarning):
    """A sensor lies where bodies touch and does not say which it measures."""


@dataclass(frozen=True)
class Sensor:
    """A name, a point of the undeformed structure in m, a direction "x", "y" or "z", and the body where two touch."""

    name: str
    point: tuple[float, float, float]
    direction: str
    body: str | None = None


def sensor_rows(model: Model, sensors: Sequence[Sensor]) -> FloatArray:
    """Rows S with x = S u for each sensor, (n_sensor, n_dof), by the shape functions of the cell around the point.

    A point outside all bodies raises ``FemInputError``. Where bodies touch, a sensor without ``body`` measures the one
    that is listed first and issues ``SensorWarning``: tied they move alike, in contact they slip and part.
    """
    rows = np.zeros((len(sensors), model.n_dof))
    for row, sensor in zip(rows, sensors, strict=True):
        where = f"sensor {sensor.name}"
        if sensor.direction not in AXES:
            raise FemInputError("unknown direction", where=where, value=sensor.direction)
        body = _first_body(model, sensor, where) if sensor.body is None else sensor.body
        found = cell_of_point(model.bodies, model.offsets, sensor.point, where=where, body=body)
        row[3 * found.nodes + AXES[sensor.direction]] = found.shape
    return rows


def _first_body(model: Model, sensor: Sensor, where: str) -> str | None:
    names = bodies_at_point(model.bodies, sensor.point, where=where)
    if len(names) > 1:
        warnings.warn(
            f"{where} lies on {' and '.join(names)} and measures {names[0]}; name its body if another is meant",
            SensorWarning,
            stacklevel=3,
        )
    return names[0] if names else None
