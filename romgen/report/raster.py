"""A small depth-buffer renderer: which triangle every pixel sees, and where in it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import BoolArray, FloatArray, IntArray
from romgen.compiled import compiled


@dataclass(frozen=True)
class Raster:
    """What every pixel of a picture sees; row 0 is the lower edge.

    Attributes
    ----------
    triangle : (n_row, n_column) triangle in front, -1 where there is none.
    weights : (n_row, n_column, 3) barycentric coordinates of the pixel in its triangle.
    edge_px : (n_row, n_column) distance in pixels to the nearest drawn edge of that triangle.
    extent : left, right, lower, upper edge of the picture in the units of the points.
    """

    triangle: IntArray = field(metadata={"unit": "1", "axes": "row,column"})
    weights: FloatArray = field(metadata={"unit": "1", "axes": "row,column,corner"})
    edge_px: FloatArray = field(metadata={"unit": "px", "axes": "row,column"})
    extent: tuple[float, float, float, float]


@compiled
def _fill(
    p: FloatArray, triangles: IntArray, drawn: BoolArray, triangle: IntArray, weights: FloatArray, edge_px: FloatArray
) -> None:
    """Paint triangle after triangle where it is nearer than what is there; p (n, 3) in px, depth last (near > far)."""
    n_row, n_column = triangle.shape
    depth = np.full((n_row, n_column), -np.inf)
    w = np.empty(3)
    for k in range(triangles.shape[0]):
        a, b, c = p[triangles[k, 0]], p[triangles[k, 1]], p[triangles[k, 2]]
        twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(twice_area) < 1e-9:
            continue
        lengths = (
            np.hypot(c[0] - b[0], c[1] - b[1]),
            np.hypot(a[0] - c[0], a[1] - c[1]),
            np.hypot(b[0] - a[0], b[1] - a[1]),
        )
        for row in range(max(int(min(a[1], b[1], c[1])), 0), min(int(max(a[1], b[1], c[1])) + 2, n_row)):
            for column in range(max(int(min(a[0], b[0], c[0])), 0), min(int(max(a[0], b[0], c[0])) + 2, n_column)):
                x, y = column + 0.5, row + 0.5
                w[0] = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / twice_area
                w[1] = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / twice_area
                w[2] = 1.0 - w[0] - w[1]
                z = w[0] * a[2] + w[1] * b[2] + w[2] * c[2]
                if w.min() < -1e-9 or z <= depth[row, column]:
                    continue
                depth[row, column], triangle[row, column] = z, k
                nearest = np.inf
                for i in range(3):
                    weights[row, column, i] = w[i]
                    if drawn[k, i]:
                        nearest = min(nearest, w[i] * abs(twice_area) / lengths[i])
                edge_px[row, column] = nearest


def rasterise(seen: FloatArray, triangles: IntArray, drawn: BoolArray, width_px: int) -> Raster:
    """Fill a picture of the given width with triangles in parallel projection.

    Parameters
    ----------
    seen : (n_node, 3) right, up, towards the viewer, any length unit.
    triangles : (n_triangle, 3) corner nodes.
    drawn : (n_triangle, 3) whether the edge opposite each corner is an edge of the mesh.
    width_px : columns of the picture; the height follows from the shape.
    """
    shown = seen[np.unique(triangles)]
    low, high = shown.min(axis=0), shown.max(axis=0)
    scale = (width_px - 4) / (high[0] - low[0])
    size = (int(np.ceil(scale * (high[1] - low[1]))) + 4, width_px)
    triangle, weights = np.full(size, -1, dtype=np.int64), np.zeros((*size, 3))
    edge_px = np.full(size, np.inf)
    _fill(scale * (seen - low) + np.array([2.0, 2.0, 0.0]), triangles, drawn, triangle, weights, edge_px)
    left, lower = low[0] - 2.0 / scale, low[1] - 2.0 / scale
    return Raster(triangle, weights, edge_px, (left, left + size[1] / scale, lower, lower + size[0] / scale))
