"""The cell around a material point and its shape functions there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.body import Body
from fem.element import ReferenceElement, reference_element
from fem.errors import FemInputError
from fem.finite_values import finite_vector
from fem.names import nearest

_NEIGHBOURS = 27
_OUTSIDE = 0.02
"""Largest distance from a cell, in cell widths, at which a point still counts as on it."""


@dataclass(frozen=True)
class CellPoint:
    """A point in a cell: ``nodes`` (n_local,) numbers in the model, ``shape`` (n_local,) shape functions there."""

    nodes: IntArray
    shape: FloatArray


def cell_of_point(
    bodies: Sequence[Body], offsets: IntArray, point: Sequence[float], *, where: str, body: str | None = None
) -> CellPoint:
    """The cell of any body, or of the one named, that contains a point of the undeformed structure (m).

    ``where`` says who asks. ``FemInputError`` where the point lies outside (with the nearest node), where no body is
    named and several contain it, since bodies that touch move apart, and where the named body does not exist.
    """
    place = finite_vector(point, "the point", where=where)
    names = [part.name for part in bodies]
    if body is not None and body not in names:
        raise FemInputError("unknown body", where=where, value=body, advice=nearest(body, names, "bodies are"))
    asked = [number for number, name in enumerate(names) if body in (None, name)]
    found = {number: _closest(bodies[number], place) for number in asked}
    on = [number for number in asked if found[number][0] <= _OUTSIDE]
    if len(on) > 1:
        advice = f"name one: body = {' or '.join(repr(names[number]) for number in on)}"
        raise FemInputError("the point lies on several bodies", where=where, value=tuple(point), advice=advice)
    if not on:
        points = np.vstack([bodies[number].mesh.points for number in asked])
        closest = points[np.linalg.norm(points - place, axis=1).argmin()]
        raise FemInputError(
            f"the point lies outside {'all bodies' if body is None else body}",
            where=where,
            value=tuple(point),
            advice=f"the nearest node is at {tuple(float(x) for x in closest.round(6))}",
        )
    _, nodes, shape = found[on[0]]
    return CellPoint(nodes + int(offsets[on[0]]), shape)


def bodies_at_point(bodies: Sequence[Body], point: Sequence[float], *, where: str) -> tuple[str, ...]:
    """Names of the bodies on which a point of the undeformed structure (m) lies."""
    place = finite_vector(point, "the point", where=where)
    return tuple(body.name for body in bodies if _closest(body, place)[0] <= _OUTSIDE)


def _closest(body: Body, point: FloatArray) -> tuple[float, IntArray, FloatArray]:
    """How far outside the closest cell the point lies (reference units), that cell's nodes and shape functions."""
    reference = reference_element(body.mesh.element)
    centre = body.mesh.points[body.mesh.cells].mean(axis=1)
    near = np.linalg.norm(centre - point, axis=1).argsort()[:_NEIGHBOURS]
    best: tuple[float, IntArray, FloatArray] | None = None
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
