"""Sensors: one displacement component at a material point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.element import ReferenceElement, reference_element
from fem.errors import FemInputError
from fem.model import AXES, Body, Model

_NEIGHBOURS = 27
_OUTSIDE = 0.02
"""Largest distance from a cell, in cell widths, at which a point still counts as on it."""


@dataclass(frozen=True)
class Sensor:
    """A name, a point of the undeformed structure in m and a direction "x", "y" or "z"."""

    name: str
    point: tuple[float, float, float]
    direction: str


def sensor_rows(model: Model, sensors: Sequence[Sensor]) -> FloatArray:
    """Rows S with x = S u for each sensor, (n_sensor, n_dof), by the shape functions of the cell around the point.

    A point outside all bodies raises ``FemInputError`` with the nearest node.
    """
    rows = np.zeros((len(sensors), model.n_dof))
    for row, sensor in zip(rows, sensors, strict=True):
        if sensor.direction not in AXES:
            raise FemInputError("unknown direction", where=f"sensor {sensor.name}", value=sensor.direction)
        found = [_locate(body, np.array(sensor.point)) for body in model.bodies]
        outside, nodes, shape = min(
            ((miss, n + offset, s) for (miss, n, s), offset in zip(found, model.offsets, strict=True)),
            key=lambda item: item[0],
        )
        if outside > _OUTSIDE:
            nearest = model.points[np.linalg.norm(model.points - sensor.point, axis=1).argmin()]
            raise FemInputError(
                "the point lies outside all bodies",
                where=f"sensor {sensor.name}",
                value=sensor.point,
                advice=f"the nearest node is at {tuple(float(x) for x in nearest.round(6))}",
            )
        row[3 * nodes + AXES[sensor.direction]] = shape
    return rows


def _locate(body: Body, point: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """How far outside the closest cell the point lies (reference units), that cell's nodes and shape functions."""
    reference = reference_element(body.mesh.element)
    centre = body.mesh.points[body.mesh.cells].mean(axis=1)
    near = np.linalg.norm(centre - point, axis=1).argsort()[:_NEIGHBOURS]
    best: tuple[float, FloatArray, FloatArray] | None = None
    for cell in near:
        nodes = body.mesh.cells[cell]
        xi = _inverse_map(reference, body.mesh.points[nodes], point)
        outside = float(max(np.max(-xi), np.max(xi - 1.0), 0.0))
        if reference.name == "tet10":
            outside = float(max(np.max(-xi), xi.sum() - 1.0, 0.0))
        if best is None or outside < best[0]:
            best = (outside, nodes, reference.shape(xi[None])[0][0])
    assert best is not None
    return best


def _inverse_map(reference: ReferenceElement, corner: FloatArray, point: FloatArray) -> FloatArray:
    xi = np.full(3, 0.25 if reference.name == "tet10" else 0.5)
    for _ in range(20):
        n, dn = reference.shape(xi[None])
        step = np.linalg.solve(corner.T @ dn[0], n[0] @ corner - point)
        xi = np.clip(xi - step, -2.0, 3.0)
        if np.abs(step).max() < 1e-13:
            break
    return xi
