"""Convex clipping of plane polygons and their split into integration cells."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.compiled import compiled
from fem.element import gauss_rule

MAX_CORNERS = 16
"""Room for the corners of a polygon: those of a facet and two per side of two convex windows."""

_STRAIGHT = 1e-9
"""Sine of the turn at a corner below which the corner is left out."""


@compiled
def clip(polygons: FloatArray, counts: IntArray, window: FloatArray) -> None:
    """Replace polygons (n, MAX_CORNERS, 2) with ``counts`` (n,) corners by what lies in a convex window (m, 2).

    The window turns anticlockwise. Sutherland & Hodgman, Reentrant polygon clipping, Comm. ACM 17 (1974) 32-42.
    """
    n_side = len(window)
    work = np.empty((MAX_CORNERS, 2))
    for p in range(len(polygons)):
        polygon = polygons[p]
        count = counts[p]
        for side in range(n_side):
            ax, ay = window[side]
            bx, by = window[(side + 1) % n_side]
            kept = 0
            for i in range(count):
                px, py = polygon[i]
                qx, qy = polygon[(i + 1) % count]
                inside_p = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
                inside_q = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
                if inside_p >= 0.0 and kept < MAX_CORNERS:
                    work[kept, 0], work[kept, 1] = px, py
                    kept += 1
                if (inside_p >= 0.0) != (inside_q >= 0.0) and kept < MAX_CORNERS:
                    t = inside_p / (inside_p - inside_q)
                    work[kept, 0], work[kept, 1] = px + t * (qx - px), py + t * (qy - py)
                    kept += 1
            count = kept
            polygon[:count] = work[:count]
        counts[p] = count


@compiled
def straighten(polygons: FloatArray, counts: IntArray) -> None:
    """Leave out, in place, corners that repeat the one before (within 1e-12) or lie on a straight edge."""
    work = np.empty((MAX_CORNERS, 2))
    for p in range(len(polygons)):
        polygon, kept = polygons[p], 0
        for i in range(counts[p]):
            px, py = polygon[i - 1] if i > 0 else polygon[counts[p] - 1]
            if max(abs(polygon[i, 0] - px), abs(polygon[i, 1] - py)) > 1e-12:
                work[kept] = polygon[i]
                kept += 1
        count, kept = kept, 0
        for i in range(count):
            px, py = work[i - 1] if i > 0 else work[count - 1]
            qx, qy = work[(i + 1) % count]
            ux, uy, vx, vy = work[i, 0] - px, work[i, 1] - py, qx - work[i, 0], qy - work[i, 1]
            if abs(ux * vy - uy * vx) > _STRAIGHT * np.sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy)):
                polygon[kept] = work[i]
                kept += 1
        counts[p] = kept


@compiled
def areas(polygons: FloatArray, counts: IntArray) -> FloatArray:
    """Signed areas (n,), positive anticlockwise."""
    result = np.zeros(len(polygons))
    for p in range(len(polygons)):
        for i in range(counts[p]):
            ax, ay = polygons[p, i]
            bx, by = polygons[p, (i + 1) % counts[p]]
            result[p] += 0.5 * (ax * by - ay * bx)
    return result


def integration_points(corners: FloatArray, *, full: bool) -> tuple[FloatArray, FloatArray]:
    """Points (n_point, 2) and weights (n_point,) of one polygon with corners (n, 2), positive anticlockwise.

    Four corners: Gauss points of the bilinear map, 2 x 2 on a parallelogram (degree 3) unless ``full``, 3 x 3
    otherwise. Other polygons: triangles around the first corner with 6 points each (degree 4).
    """
    if len(corners) == 4:
        twist = np.abs(corners[0] - corners[1] + corners[2] - corners[3]).max()
        slanted = twist > 1e-9 * np.ptp(corners, axis=0).max()
        return _mapped("quad8", 5 if full or slanted else 3, corners)
    parts = [_mapped("tri6", 4, corners[[0, i, i + 1]]) for i in range(1, len(corners) - 1)]
    return np.vstack([x for x, _ in parts]), np.concatenate([w for _, w in parts])


def _mapped(name: str, degree: int, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    x, w = gauss_rule(name, degree)
    a, b, c = corners[0], corners[1], corners[-1]
    u, v = b - a, c - a
    twist = corners[2] - b - c + a if len(corners) == 4 else np.zeros(2)
    s, t = x[:, :1], x[:, 1:]
    du, dv = u + t * twist, v + s * twist
    det = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
    return a + s * u + t * v + s * t * twist, w * det
