"""Supports: displacement components that are held, at zero or at a given value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.body import Body, locate
from fem.errors import FemInputError
from fem.pairing import surface_points

AXES = {"x": 0, "y": 1, "z": 2}
_ALIGNED = 1e-6
"""How far the normals of a symmetry plane may deviate from a global axis."""

Displacement = float | Sequence[float] | Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Support:
    """Held displacement components of a surface, line or point.

    Attributes
    ----------
    surface : "<body>.<surface>", "<body>.<node set>", or "<body>.<a>&<b>" for the nodes that both have: the edge of two
        faces, the corner of three.
    directions : among "x", "y", "z"; "normal" is the axis along which a plane surface faces: a plane of symmetry.
    displacement : m, at load factor 1; one number for all directions, one for each, or a function from points (n, 3) to
        the displacement (n, 3) there.
    """

    surface: str
    directions: tuple[str, ...]
    displacement: Displacement = 0.0


def held(
    bodies: Sequence[Body], offsets: IntArray, n_node: int, supports: Sequence[Support]
) -> tuple[BoolArray, FloatArray]:
    """Free degrees of freedom (n_dof,) and the prescribed displacement (n_dof,) in m of the others.

    Raises
    ------
    FemInputError : unknown names or directions, values that are not finite, two values for one component.
    """
    free = np.ones((n_node, 3), dtype=bool)
    prescribed = np.zeros((n_node, 3))
    points = np.vstack([body.mesh.points for body in bodies])
    for support in supports:
        nodes, axes = components(bodies, offsets, support)
        values = _values(support, points[nodes], axes)
        for column, axis in enumerate(axes):
            given = ~free[nodes, axis]
            if np.any(given & (prescribed[nodes, axis] != values[:, column])):
                raise FemInputError(
                    "a node is held at two different displacements",
                    where=f"support {support.surface}, direction {'xyz'[axis]}",
                    advice="let one support hold it, or give both the same value",
                )
            free[nodes, axis] = False
            prescribed[nodes, axis] = values[:, column]
    return free.ravel(), prescribed.ravel()


def components(bodies: Sequence[Body], offsets: IntArray, support: Support) -> tuple[IntArray, list[int]]:
    """Nodes (n,) that a support holds and the axes 0, 1, 2 along which it does; raises as ``held``."""
    where = f"support {support.surface}"
    index, region = locate(bodies, support.surface, where=where)
    nodes = bodies[index].mesh.nodes(region, where=where) + offsets[index]
    return nodes, [_axis(bodies[index], region, support, direction) for direction in support.directions]


def _axis(body: Body, region: str, support: Support, direction: str) -> int:
    if direction in AXES:
        return AXES[direction]
    where = f"support {support.surface}"
    if direction != "normal":
        raise FemInputError("unknown direction", where=where, value=direction, advice="choose x, y, z or normal")
    if region not in body.mesh.surfaces:
        raise FemInputError("not a surface", where=where, value="normal", advice="name the axis of a line or a point")
    normals = surface_points(body.mesh.points, body.mesh.surface(region)).normals
    axis = int(np.abs(normals[0]).argmax())
    if np.any(np.abs(normals[:, axis]) < 1.0 - _ALIGNED):
        advice = "a support along the normal needs a plane that faces along x, y or z; a Foundation holds any other"
        raise FemInputError("not a plane across an axis", where=where, value="normal", advice=advice)
    return axis


def _values(support: Support, points: FloatArray, axes: Sequence[int]) -> FloatArray:
    """Prescribed displacement (n, n_direction) in m."""
    where = f"support {support.surface}"
    if callable(support.displacement):
        field = np.asarray(support.displacement(points), dtype=float)
        if field.shape != points.shape:
            advice = "the function must return one (x, y, z) per point"
            raise FemInputError("not a displacement field", where=where, value=field.shape, advice=advice)
        values = field[:, axes]
    else:
        given = np.atleast_1d(np.asarray(support.displacement, dtype=float))
        if given.shape not in {(1,), (len(axes),)}:
            advice = f"give one number or one for each of {', '.join(support.directions)}"
            raise FemInputError("not a displacement", where=where, value=support.displacement, advice=advice)
        values = np.broadcast_to(given, (len(points), len(axes)))
    if not np.isfinite(values).all():
        raise FemInputError("the prescribed displacement is not finite", where=where, value=support.displacement)
    return np.asarray(values)
