"""Graded meshes of curved bodies in contact: cylinders on a block and spheres, for the cases of Hertz and Mindlin."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.block import hex_block
from fem.merge import merged
from fem.mesh import Mesh, within


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


CORE = 2
"""Cells along half a side of the square in the middle of a ``polar_cap``; a quarter of a ring has twice as many."""


def polar_cap(core: float, radii: FloatArray, depth: FloatArray, sphere: float, *, upward: bool) -> Mesh:
    """Half (z >= 0) of a disc whose contact face is a sphere: a square in the middle, rings of any width around it.

    Rings may be fine where the sliding zone ends and coarse elsewhere, all around. The body lies above its face y_min,
    or ``upward`` below its face y_max; its plane z = 0 is "plane".

    Parameters
    ----------
    core : half side of the square, m, less than 0.75 of the first radius; its sides are bent outwards.
    radii : (n,) m; from the third on rings are circles. depth : (n,) m from the contact face.
    """
    vertical = -depth[::-1] if upward else depth
    half = np.linspace(0.0, 1.0, CORE + 1)

    def bend(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        sag = sphere - np.sqrt(sphere * sphere - x * x - z * z)
        lift = (1.0 - np.abs(y) / depth[-1]) * sag
        return np.column_stack([x, y - lift if upward else y + lift, z])

    def square(p: FloatArray) -> FloatArray:
        x, z = _bulged(p[:, 0], p[:, 2], core)
        return bend(x, p[:, 1], z)

    def ring(turn: float) -> Mesh:
        def place(p: FloatArray) -> FloatArray:
            # Directions of the nodes of a side of the square, so that rings and square share their nodes.
            x, z = _bulged(np.ones(len(p)), p[:, 2], core)
            inner = np.clip((radii[2] - p[:, 0]) / (radii[2] - radii[0]), 0.0, 1.0)
            angle = 0.25 * np.pi * p[:, 2]
            x = inner * x + (1.0 - inner) * p[:, 0] * np.cos(angle)
            z = inner * z + (1.0 - inner) * p[:, 0] * np.sin(angle)
            return bend(np.cos(turn) * x - np.sin(turn) * z, p[:, 1], np.sin(turn) * x + np.cos(turn) * z)

        side = {0.0: half, 0.5 * np.pi: np.concatenate([-half[:0:-1], half]), np.pi: -half[::-1]}[turn]
        return hex_block(radii, vertical, side, mapping=place)

    middle = hex_block(np.concatenate([-half[:0:-1], half]), vertical, half, mapping=square)
    whole = merged([middle, *(ring(turn) for turn in (0.0, 0.5 * np.pi, np.pi))])
    return whole.with_region("plane", within(z=(0.0, 0.0)))


def _bulged(x: FloatArray, z: FloatArray, core: float) -> tuple[FloatArray, FloatArray]:
    """Points of the square |x|, |z| <= 1 scaled to ``core``, moved half the way to circles towards its sides."""
    size = np.maximum(np.abs(x), np.abs(z))
    safe = np.where(size > 0.0, size, 1.0)
    along = np.abs(x) >= np.abs(z)
    angle = 0.25 * np.pi * np.where(along, z, x) / safe * np.where(along, np.sign(x), np.sign(z))
    far, near = np.cos(angle), np.sin(angle)
    round_x = np.where(along, np.sign(x) * far, np.sign(z) * near)
    round_z = np.where(along, np.sign(x) * near, np.sign(z) * far)
    share = 0.5 * size
    scale = 1.15 * size
    return (
        core * ((1.0 - share) * x + share * scale * round_x),
        core * ((1.0 - share) * z + share * scale * round_z),
    )
