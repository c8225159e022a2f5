"""Pictures of the outer surface of a structure: projection, colours, light, mesh lines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from romgen.arrays import BoolArray, FloatArray, IntArray
from romgen.report.raster import Raster, rasterise
from romgen.structure import Structure

# Corner pairs of the element edges, VTK order.
_HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_AZIMUTH, _ELEVATION = np.radians(-58.0), np.radians(36.0)
# Direction to the light: left, up and towards the viewer.
_LIGHT = np.array([-0.45, 0.7, 0.55])
_LINE_PX, _LINE_DARKNESS = 1.3, 0.35

Colouring = Callable[[Raster], FloatArray]


def _edge_keys(first: IntArray, second: IntArray, n_node: int) -> IntArray:
    """One integer per undirected edge."""
    keys: IntArray = np.minimum(first, second) * n_node + np.maximum(first, second)
    return keys


def mesh_edges(structure: Structure) -> BoolArray:
    """(n_triangle, 3) whether the edge opposite each corner of a skin triangle is an element edge, not a diagonal."""
    n_node = structure.points.shape[0]
    keys = []
    for body, kind in enumerate(structure.cell_types):
        pairs = np.array(_TET_EDGES if kind == "tet10" else _HEX_EDGES)
        cells = structure.cells[structure.cell_body == body]
        keys.append(_edge_keys(cells[:, pairs[:, 0]], cells[:, pairs[:, 1]], n_node).ravel())
    in_cells = np.concatenate(keys)
    following, last = np.roll(structure.skin, -1, axis=1), np.roll(structure.skin, -2, axis=1)
    return np.isin(_edge_keys(following, last, n_node), in_cells)


def triangle_body(structure: Structure) -> IntArray:
    """(n_triangle,) body of each skin triangle: the one that holds all its corners."""
    holds = np.zeros((structure.points.shape[0], len(structure.bodies)), dtype=bool)
    used = structure.cells >= 0
    holds[structure.cells[used], np.repeat(structure.cell_body, used.sum(axis=1))] = True
    body: IntArray = np.argmax(holds[structure.skin].all(axis=1), axis=1).astype(np.int64)
    return body


def view_frame(points: FloatArray) -> FloatArray:
    """(3, 3) orthonormal rows: right and up in the picture, and towards the viewer.

    The structure lies flat: its shortest extent points up and its longest to the right and towards the viewer.

    Parameters
    ----------
    points : (n_node, 3) m, undeformed.
    """
    shortest, _, longest = np.argsort(np.ptp(points, axis=0), kind="stable")
    axes = np.eye(3)
    basis = np.array([axes[longest], np.cross(axes[shortest], axes[longest]), axes[shortest]])
    a, e = _AZIMUTH, _ELEVATION
    right = [-np.sin(a), np.cos(a), 0.0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    towards = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    frame: FloatArray = np.array([right, up, towards]) @ basis
    return frame


def _brightness(seen: FloatArray, triangles: IntArray) -> FloatArray:
    """(n_triangle,) of light; thin sheets are seen from both sides, so the sign of the normal does not count."""
    corners = seen[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)
    brightness: FloatArray = np.minimum(0.7 + 0.3 * np.abs(normals @ _LIGHT) / length, 1.0)
    return brightness


def draw_skin(axes: Axes, structure: Structure, points: FloatArray, colouring: Colouring, width_px: int) -> None:
    """Draw the skin in parallel projection, true to scale, with light and mesh lines.

    Parameters
    ----------
    axes : empty axes; they lose their frame.
    structure : the mesh.
    points : (n_node, 3) m, as drawn (deformed).
    colouring : colour of every pixel, (n_row, n_column, 3), from what it sees.
    width_px : columns of the picture.
    """
    seen = points @ view_frame(structure.points).T
    raster = rasterise(seen, structure.skin, mesh_edges(structure), width_px)
    light = _brightness(seen, structure.skin)[raster.triangle]
    line = 1.0 - _LINE_DARKNESS * np.clip(1.5 * _LINE_PX - raster.edge_px, 0.0, 1.0)
    colours = colouring(raster) * (light * line)[:, :, None]
    opaque = (raster.triangle >= 0).astype(float)
    picture = np.dstack([np.clip(colours, 0.0, 1.0), opaque])
    axes.imshow(picture, origin="lower", extent=raster.extent, interpolation="antialiased", interpolation_stage="rgba")
    axes.set_axis_off()


def draw_triad(axes: Axes, points: FloatArray) -> None:
    """Arrows x, y, z at the lower left corner of the picture of these points, a tenth of the structure long."""
    right, up, _ = view_frame(points)
    length = 0.1 * np.ptp(points, axis=0).max()
    x = axes.get_xlim()[0] + length * (0.3 - min(right.min(), 0.0))
    y = axes.get_ylim()[0] + length * (0.3 - min(up.min(), 0.0))
    for k, name in enumerate("xyz"):
        dx, dy = length * right[k], length * up[k]
        arrow = {"arrowstyle": "->", "color": "#30343B"}
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops=arrow, annotation_clip=False)
        axes.text(x + 1.25 * dx, y + 1.25 * dy, name, color="#30343B", fontsize=9, ha="center", va="center")
