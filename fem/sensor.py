"""Sensors: one displacement component at a material point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.locate_point import cell_of_point
from fem.model import AXES, Model


@dataclass(frozen=True)
class Sensor:
    """A name, a point of the undeformed structure in m, a direction "x", "y" or "z", and the body where two touch."""

    name: str
    point: tuple[float, float, float]
    direction: str
    body: str | None = None


def sensor_rows(model: Model, sensors: Sequence[Sensor]) -> FloatArray:
    """Rows S with x = S u for each sensor, (n_sensor, n_dof), by the shape functions of the cell around the point.

    A point outside all bodies, or on several without ``body``, raises ``FemInputError``.
    """
    rows = np.zeros((len(sensors), model.n_dof))
    for row, sensor in zip(rows, sensors, strict=True):
        where = f"sensor {sensor.name}"
        if sensor.direction not in AXES:
            raise FemInputError("unknown direction", where=where, value=sensor.direction)
        found = cell_of_point(model.bodies, model.offsets, sensor.point, where=where, body=sensor.body)
        row[3 * found.nodes + AXES[sensor.direction]] = found.shape
    return rows
