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

_NEIGHBOURS = 27
_OUTSIDE = 0.02
"""Largest distance from a cell, in cell widths, at which a point still counts as on it."""


@dataclass(frozen=True)
class CellPoint:
    """A point in a cell: ``nodes`` (n_local,) numbers in the model, ``shape`` (n_local,) shape functions there."""

    nodes: IntArray
    shape: FloatArray


def cell_of_point(bodies: Sequence[Body], offsets: IntArray, point: Sequence[float], *, where: str) -> CellPoint:
    """The cell of any body that contains a point of the undeformed structure (m).

    A point outside all bodies raises ``FemInputError`` with the nearest node; ``where`` says who asks.
    """
    place = finite_vector(point, "the point", where=where)
    found = [_closest(body, place) for body in bodies]
    outside, nodes, shape = min(
        ((miss, n + offset, s) for (miss, n, s), offset in zip(found, offsets, strict=True)),
        key=lambda item: item[0],
    )
    if not outside <= _OUTSIDE:
        points = np.vstack([body.mesh.points for body in bodies])
        nearest = points[np.linalg.norm(points - place, axis=1).argmin()]
        raise FemInputError(
            "the point lies outside all bodies",
            where=where,
            value=tuple(point),
            advice=f"the nearest node is at {tuple(float(x) for x in nearest.round(6))}",
        )
    return CellPoint(nodes, shape)


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
