"""Pictures of the outer surface: polygons of the skin, projected, shaded and painted from back to front."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from romgen.arrays import FloatArray, IntArray
from romgen.structure import Structure

# Corner pairs of the edges of a hexahedron, VTK order.
_HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_AZIMUTH, _ELEVATION = np.radians(-58.0), np.radians(27.0)
_LIGHT = np.array([-0.35, -0.45, 0.82])


def _edge_keys(first: IntArray, second: IntArray, n_node: int) -> IntArray:
    """One integer per undirected edge."""
    keys: IntArray = np.minimum(first, second) * n_node + np.maximum(first, second)
    return keys


def skin_faces(structure: Structure) -> IntArray:
    """The faces of the skin: triangles for tets, quadrilaterals for hexes (pairs of triangles rejoined).

    Returns
    -------
    (n_face, 3) or (n_face, 4) corner nodes in cyclic order.
    """
    triangles, n_node = structure.skin, structure.points.shape[0]
    if structure.cell_type == "tet10":
        return triangles
    pairs = np.array(_HEX_EDGES)
    in_cells = _edge_keys(structure.cells[:, pairs[:, 0]], structure.cells[:, pairs[:, 1]], n_node)
    keys = _edge_keys(triangles, np.roll(triangles, -1, axis=1), n_node)
    diagonal = np.argmin(np.isin(keys, in_cells), axis=1)  # the one edge of each triangle that no cell has
    order = np.argsort(keys[np.arange(len(triangles)), diagonal], kind="stable")
    first, second = order[0::2], order[1::2]
    apex = triangles[second, (diagonal[second] + 2) % 3]
    a, b, c = (triangles[first, (diagonal[first] + k) % 3] for k in range(3))
    return np.column_stack([a, apex, b, c])


def node_body(structure: Structure) -> IntArray:
    """(n_node,) index of the body each node belongs to (the last one where bodies share nodes)."""
    body = np.zeros(structure.points.shape[0], dtype=np.int64)
    body[structure.cells] = structure.cell_body[:, None]
    return body


def view_frame() -> FloatArray:
    """(3, 3) orthonormal rows: right and up in the picture, and towards the viewer."""
    a, e = _AZIMUTH, _ELEVATION
    right = [-np.sin(a), np.cos(a), 0.0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    towards = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    return np.array([right, up, towards])


def _shading(polygons: FloatArray) -> FloatArray:
    """(n_face,) brightness; thin sheets are seen from both sides, so the sign of the normal does not count."""
    normals = np.cross(polygons[:, 1] - polygons[:, 0], polygons[:, 2] - polygons[:, 0])
    length = np.linalg.norm(normals, axis=1)
    shade: FloatArray = 0.68 + 0.32 * np.abs(normals @ _LIGHT) / np.maximum(length, np.finfo(float).tiny)
    return np.minimum(shade, 1.0)


def draw_faces(axes: Axes, points: FloatArray, faces: IntArray, colours: FloatArray) -> None:
    """Draw the skin in parallel projection, true to scale, far faces first.

    Parameters
    ----------
    axes : empty axes; they lose their frame.
    points : (n_node, 3) m, as drawn (deformed).
    faces : (n_face, 3 or 4) corner nodes.
    colours : (n_face, 4) RGBA.
    """
    seen = points[faces] @ view_frame().T
    order = np.argsort(seen[:, :, 2].mean(axis=1))
    shaded = np.column_stack([colours[:, :3] * _shading(points[faces])[:, None], np.ones(len(faces))])
    outlines = list(seen[order][:, :, :2])
    axes.add_collection(PolyCollection(outlines, facecolors=shaded[order], edgecolors="#0000003c", linewidths=0.3))
    axes.autoscale_view()
    axes.margins(0.02)
    axes.set_aspect("equal")
    axes.set_axis_off()


def draw_triad(axes: Axes, length: float) -> None:
    """Arrows x, y, z of the given length in m at the lower left corner of the picture."""
    right, up, _ = view_frame()
    x, y = axes.get_xlim()[0] + 0.3 * length, axes.get_ylim()[0] + 0.6 * length
    for k, name in enumerate("xyz"):
        dx, dy = length * right[k], length * up[k]
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops={"arrowstyle": "->", "color": "#30343B"})
        axes.text(x + 1.25 * dx, y + 1.25 * dy, name, color="#30343B", fontsize=9, ha="center", va="center")
