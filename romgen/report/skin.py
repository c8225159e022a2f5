"""Pictures of the outer surface in three dimensions: polygons of the skin, colours, deformation."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LightSource
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from romgen.arrays import FloatArray, IntArray
from romgen.structure import Structure

# Corner pairs of the element edges, VTK order.
_EDGES = {
    "tet10": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hex": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
}


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
    pairs = np.array(_EDGES["hex"])
    in_cells = _edge_keys(structure.cells[:, pairs[:, 0]], structure.cells[:, pairs[:, 1]], n_node)
    keys = _edge_keys(triangles, np.roll(triangles, -1, axis=1), n_node)
    diagonal = np.argmin(np.isin(keys, in_cells), axis=1)  # the one edge of each triangle that no cell has
    rows = np.arange(len(triangles))
    order = np.argsort(keys[rows, diagonal], kind="stable")
    first, second = order[0::2], order[1::2]
    apex = triangles[second, (diagonal[second] + 2) % 3]
    a, b, c = (triangles[first, (diagonal[first] + k) % 3] for k in range(3))
    return np.column_stack([a, apex, b, c])


def node_body(structure: Structure) -> IntArray:
    """(n_node,) index of the body each node belongs to (the last one where bodies share nodes)."""
    body = np.zeros(structure.points.shape[0], dtype=np.int64)
    body[structure.cells] = structure.cell_body[:, None]
    return body


def draw_faces(axes: Axes3D, points: FloatArray, faces: IntArray, colours: FloatArray, edge: str = "#00000030") -> None:
    """Draw shaded polygons of the given (n_face, 3 or 4) RGBA colours with a true aspect ratio and no box."""
    polygons = points[faces]
    normals = np.cross(polygons[:, 1] - polygons[:, 0], polygons[:, 2] - polygons[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    light = LightSource(azdeg=225.0, altdeg=55.0).direction
    # Faces of thin sheets are seen from both sides, so only the angle to the light counts, not its sign.
    shade = 0.72 + 0.28 * np.abs((normals / np.where(length > 0.0, length, 1.0)) @ light)
    shaded = np.column_stack([colours[:, :3] * shade[:, None], np.ones(len(faces))])
    axes.add_collection3d(Poly3DCollection(polygons, facecolors=shaded, edgecolors=edge, linewidths=0.25))
    low, high = points[np.unique(faces)].min(axis=0), points[np.unique(faces)].max(axis=0)
    extent = np.maximum(high - low, 1e-3 * (high - low).max())
    axes.set(xlim=(low[0], low[0] + extent[0]), ylim=(low[1], low[1] + extent[1]), zlim=(low[2], low[2] + extent[2]))
    axes.set_box_aspect(extent, zoom=1.35)
    axes.view_init(elev=24.0, azim=-58.0)
    axes.set_axis_off()


def draw_triad(axes: Axes3D, points: FloatArray) -> None:
    """Arrows x, y, z at the lower corner of the picture, one tenth of the model long."""
    low, high = points.min(axis=0), points.max(axis=0)
    length = 0.1 * (high - low).max()
    origin = np.array([low[0], low[1] - 0.06 * (high - low).max(), low[2]])
    for k, name in enumerate("xyz"):
        step = np.zeros(3)
        step[k] = length
        axes.quiver(*origin, *step, color="#30343B", linewidth=1.0, arrow_length_ratio=0.25)
        axes.text(*(origin + 1.25 * step), name, color="#30343B", fontsize=8, ha="center", va="center")
