"""Small meshes and models for the tests of the finite-element half."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.block import graded, hex_block
from fem.element import reference_element
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Clamp, Model, Pair, Support, build_model

STEEL = Material(200e9, 0.3, 7800.0)


def box(
    lengths: tuple[float, float, float], cells: tuple[int, int, int], element: str = "hex20", *, shift: float = 0.0
) -> Mesh:
    """A box from the origin with ``cells`` equal intervals per axis, raised by ``shift`` m along y; also tet10."""
    lines = [graded([0.0, length], [n]) for length, n in zip(lengths, cells, strict=True)]
    return hex_block(lines[0], lines[1] + shift, lines[2], element=element)


def trilinear(points: FloatArray) -> FloatArray:
    """Trilinear shape functions of the unit cube at reference points (n, 3), VTK corner order, (n, 8)."""
    corner = reference_element("hex20").nodes[:8]
    factor = np.where(corner[None] > 0.5, points[:, None, :], 1.0 - points[:, None, :])
    return np.asarray(factor.prod(axis=2))


def distorted(mesh: Mesh, size: float, *, seed: int = 1, boundary: bool = True) -> Mesh:
    """Corners moved at random by up to ``size`` m per axis, edges straight; ``boundary`` False leaves the skin."""
    n_corner = 4 if mesh.element == "tet10" else 8
    reference = reference_element(mesh.element)
    corners = np.unique(mesh.cells[:, :n_corner])
    if not boundary:
        corners = np.setdiff1d(corners, mesh.skin())
    points = mesh.points.copy()
    points[corners] += np.random.default_rng(seed).uniform(-size, size, (len(corners), 3))
    if mesh.element == "tet10":
        x = reference.nodes
        weight = np.column_stack([1.0 - x.sum(axis=1), x])
    else:
        weight = trilinear(reference.nodes)
    points[mesh.cells] = np.einsum("ac,eci->eai", weight, points[mesh.cells[:, :n_corner]])
    return Mesh(points, mesh.cells, mesh.element, mesh.surfaces)


def single(mesh: Mesh, material: Material = STEEL, *, supports: tuple[Support, ...] = ()) -> Model:
    """A model of one body named "body"."""
    return build_model([Body("body", mesh, material)], supports=supports)


def wave(points: FloatArray, size: float) -> FloatArray:
    """A smooth displacement of about ``size`` m with finite strains and rotations, (n_dof,)."""
    scale = np.ptp(points, axis=0).max()
    x, y, z = points.T / scale
    field = np.stack([np.sin(2.0 * y + z) + x * x, np.cos(1.5 * x) * z - y, np.sin(x + y) * np.cos(z)], axis=1)
    return np.asarray(size * field.ravel())


def clamped_strip(
    *, friction: float = 0.3, clamp: float = 4e3, element: str = "hex20", kinematics: str = "linear"
) -> Model:
    """Half of a steel strip of 2 mm between a support and a blade: free half length 80 mm, symmetry at x = 0."""
    z = graded([0.0, 0.02], [1])
    panel = hex_block(graded([0.0, 0.08, 0.1], [3, 1]), graded([-1e-3, 1e-3], [1]), z, element=element)
    end = graded([0.08, 0.1], [1])
    support = hex_block(end, graded([-11e-3, -1e-3], [1]), z)
    blade = hex_block(end, graded([1e-3, 11e-3], [1]), z)
    bodies = [
        Body("panel", panel, STEEL),
        Body("support", support, STEEL, kinematics),
        Body("blade", blade, STEEL, kinematics),
    ]
    pairs = [
        Pair("lower", "panel.y_min", "support.y_max", friction),
        Pair("upper", "panel.y_max", "blade.y_min", friction),
    ]
    supports = [
        Support("panel.x_min", ("x",)),
        Support("support.y_min", ("x", "y", "z")),
        Support("blade.y_max", ("x", "z")),
        Support("panel.z_min", ("z",)),
    ]
    return build_model(bodies, pairs=pairs, supports=supports, clamps=[Clamp("bolts", "blade.y_max", clamp)])


def blocks(
    *, friction: float = 0.3, cells: tuple[int, int] = (2, 3), nu: float = 0.0, gap: float = 0.0, element: str = "hex20"
) -> Model:
    """Two unit cubes stacked along y with non-matching meshes; the upper one is the slave; no supports."""
    material = Material(2e6, nu, 1000.0)
    n, m = cells
    lower = box((1.0, 1.0, 1.0), (m, 1, m), element)
    upper = box((1.0, 1.0, 1.0), (n, 1, n), element, shift=1.0 + gap)
    bodies = [Body("lower", lower, material), Body("upper", upper, material)]
    return build_model(bodies, pairs=[Pair("joint", "upper.y_min", "lower.y_max", friction)])
