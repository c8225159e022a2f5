"""Graded meshes of curved bodies in contact: cylinders on a block and spheres, for the cases of Hertz and Mindlin."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.block import hex_block
from fem.mesh import Mesh


def graded_line(fine: float, count: int, end: float, coarse: int) -> FloatArray:
    """``count`` equal intervals up to ``fine``, then ``coarse`` growing ones up to ``end`` (m)."""
    first = fine / count
    ratio = 1.0 + 1e-9
    while first * ratio * (ratio**coarse - 1.0) / (ratio - 1.0) < end - fine:
        ratio *= 1.001
    steps = ratio ** np.arange(1, coarse + 1)
    return np.concatenate([np.linspace(0.0, fine, count + 1), fine + (end - fine) * np.cumsum(steps) / steps.sum()])


def cap(lines: tuple[FloatArray, FloatArray, FloatArray], radius: float, *, across: bool, upward: bool) -> Mesh:
    """A block whose contact face is a cylinder about z or, ``across`` too, a sphere; infinite radius: a plane.

    ``lines`` are x, depth and z; the body lies above its face y_min, or ``upward`` below its face y_max.
    """
    depth = lines[1][-1]

    def bend(points: FloatArray) -> FloatArray:
        x, y, z = points.T
        square = x * x + (z * z if across else 0.0)
        sag = radius - np.sqrt(radius * radius - square) if np.isfinite(radius) else 0.0 * x
        depth_of = -y if upward else y
        lift = (1.0 - depth_of / depth) * sag
        return np.column_stack([x, y - lift if upward else y + lift, z])

    vertical = -lines[1][::-1] if upward else lines[1]
    return hex_block(lines[0], vertical, lines[2], mapping=bend)
