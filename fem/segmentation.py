"""Slave facets cut along the edges of the master facets, so that integrals over both sides are smooth on every piece.

On a piece the shape functions of both surfaces are polynomials: Gauss points there integrate the work of a uniform
pressure exactly on both sides, which is the contact patch test (Puso & Laursen, CMAME 193 (2004) 601-629). Points
spread over whole slave facets do not see the kinks of the master and miss it by several percent.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.element import ReferenceElement
from fem.pairing import SurfacePoints, face_element, mean_size, n_corner, points_on, surface_points
from fem.polygons import MAX_CORNERS, areas, clip, integration_points, straighten

_WHOLE = 1e-3
"""A facet that one master facet covers up to this share of its area is not cut: the neglected kink lies within 1e-3 of
its edge and changes integrals by the square of that."""

_SLIVER = 1e-9

_TWICE = 0.05
"""Share by which pieces may cover a facet twice before some lie behind others; chords of curved edges overlap less."""

_MARGIN = 0.3
_FACING = 0.3
_NEWTON_STEPS = 12


def segment_points(points: FloatArray, slave: IntArray, master: IntArray, reach: float) -> SurfacePoints:
    """Integration points of the slave facets (n_facet, n_local), one rule per piece that one master facet covers.

    A facet inside a single master facet (matching meshes) keeps its own rule. What no master facet covers within
    ``reach`` (m) has no points; of master facets that lie behind each other the nearest counts. Edges of the master are
    followed by their chords in the reference coordinates of the slave: exact where the slave facets are parallelograms
    or flat triangles and the edges straight.
    """
    pairs, away = _candidates(points, slave, master, reach)
    corners, counts = _pieces(points, slave, master, pairs)
    share = areas(corners, counts) / (0.5 if slave.shape[1] == 6 else 1.0)
    facet = pairs[0]
    whole = np.unique(facet[share > 1.0 - _WHOLE])
    cut = np.flatnonzero((share > _SLIVER) & ~np.isin(facet, whole))
    size = 0.5 * mean_size(points, slave)
    cut = cut[_first_layer(facet[cut], (corners[cut], counts[cut]), share[cut], away[cut], size)]
    plain = surface_points(points, slave[whole])
    plain = replace(plain, facet=whole[plain.facet])
    if len(cut) == 0:
        return plain
    full = slave.shape[1] == 9 or master.shape[1] == 9
    rules = [integration_points(corners[p, : counts[p]], full=full) for p in cut]
    piece_facet = np.repeat(facet[cut], [len(w) for _, w in rules])
    xi, weights = np.vstack([x for x, _ in rules]), np.hstack([w for _, w in rules])
    both = plain.joined(points_on(points, slave, piece_facet, xi, weights))
    return both.taken(np.argsort(both.facet, kind="stable"))


def _candidates(
    points: FloatArray, slave: IntArray, master: IntArray, reach: float
) -> tuple[tuple[IntArray, IntArray], FloatArray]:
    """Slave and master facet numbers that face each other, and their distances along the slave normal, m.

    The bounding sphere of the master comes within ``reach`` (m) of that of the slave, before or behind it, and overlaps
    the window of the slave in its plane.
    """
    centres, radii, normals = zip(*(_spheres(points, facets) for facets in (slave, master)), strict=True)
    near = cKDTree(centres[1]).query_ball_point(centres[0], radii[0] + radii[1].max() + reach, return_sorted=True)
    s = np.repeat(np.arange(len(slave)), [len(found) for found in near])
    m = np.concatenate([np.empty(0), *near]).astype(np.int64)
    offset = centres[1][m] - centres[0][s]
    away = np.einsum("pi,pi->p", offset, normals[0][s])
    beside = np.sqrt(np.maximum(np.einsum("pi,pi->p", offset, offset) - away**2, 0.0))
    both = radii[0][s] + radii[1][m]
    close = (np.abs(away) <= both + reach) & (beside <= both + 2.0 * _MARGIN * radii[0][s])
    facing = np.einsum("pi,pi->p", normals[0][s], normals[1][m]) < -_FACING
    keep = close & facing
    return (s[keep], m[keep]), away[keep]


def _first_layer(
    facet: IntArray, pieces: tuple[FloatArray, IntArray], share: FloatArray, away: FloatArray, size: float
) -> BoolArray:
    """False for pieces that lie behind nearer ones of their slave facet.

    Slave facet, polygon, share of the facet and distance (m) of every piece, each (n_piece, ...). Facets are looked at
    where pieces cover more than all of them, or differ by ``size`` m in their distance; what lies so far behind the
    slave comes last.
    """
    keep = np.ones(len(facet), dtype=bool)
    if not len(facet):
        return keep
    depth = np.where(away < -size, np.inf, np.abs(away))
    low, high = np.full(facet.max() + 1, np.inf), np.full(facet.max() + 1, -np.inf)
    np.minimum.at(low, facet, away)
    np.maximum.at(high, facet, away)
    spread = np.where(low <= high, high, 0.0) - np.where(low <= high, low, 0.0)
    for number in np.flatnonzero((np.bincount(facet, share) > 1.0 + _TWICE) | (spread > size)):
        piece = np.flatnonzero(facet == number)
        piece = piece[np.argsort(depth[piece], kind="stable")]
        for place, own in enumerate(piece):
            nearer = piece[:place][keep[piece[:place]]]
            polygons, counts = pieces[0][nearer].copy(), pieces[1][nearer].copy()
            clip(polygons, counts, np.ascontiguousarray(pieces[0][own, : pieces[1][own]]))
            covered = np.abs(areas(polygons, counts)).sum()
            keep[own] = covered <= _TWICE * np.abs(areas(pieces[0][own : own + 1], pieces[1][own : own + 1])[0])
    return keep


def _spheres(points: FloatArray, facets: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    reference = face_element(facets)
    corner = points[facets]
    centre = corner.mean(axis=1)
    _, dn = reference.shape(_centre(reference))
    normal = np.cross(*np.einsum("ad,fai->dfi", dn[0], corner))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return centre, np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1), normal


def _centre(reference: ReferenceElement) -> FloatArray:
    return np.full((1, 2), 1.0 / 3.0 if reference.name == "tri6" else 0.5)


def _pieces(
    points: FloatArray, slave: IntArray, master: IntArray, pairs: tuple[IntArray, IntArray]
) -> tuple[FloatArray, IntArray]:
    """Master facets in the reference coordinates of the slave facets, clipped there: (n_pair, MAX_CORNERS, 2)."""
    reference = face_element(slave)
    corner = points[slave[pairs[0]]]
    tangents, centre = _affine_map(reference, corner)
    straight = _is_affine(points, slave) and _is_affine(points, master)
    outline = points[master[pairs[1], : n_corner(master)]]
    plane = np.einsum("pdi,pbi->pbd", tangents, outline - centre[:, None]) + _centre(reference)
    polygons = np.zeros((len(corner), MAX_CORNERS, 2))
    # Facing surfaces turn opposite ways.
    polygons[:, : plane.shape[1]] = plane[:, ::-1]
    counts = np.full(len(corner), plane.shape[1], dtype=np.int64)
    low, high = -_MARGIN, 1.0 + _MARGIN
    clip(polygons, counts, np.array([[low, low], [high, low], [high, high], [low, high]]))
    if not straight:
        used = np.arange(MAX_CORNERS) < counts[:, None]
        pair = np.nonzero(used)[0]
        polygons[used] = _local(reference, corner[pair], (tangents[pair], centre[pair]), polygons[used])
    window = reference.nodes[: n_corner(slave)]
    clip(polygons, counts, np.ascontiguousarray(window))
    straighten(polygons, counts)
    counts[counts < 3] = 0
    return polygons, counts


def _affine_map(reference: ReferenceElement, corner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse tangents (n, 2, 3) and centre (n, 3) of facets: reference coordinates of the plane through the centre."""
    n, dn = reference.shape(_centre(reference))
    tangents = np.einsum("ad,fai->fdi", dn[0], corner)
    return np.linalg.pinv(tangents.transpose(0, 2, 1)), np.einsum("a,fai->fi", n[0], corner)


def _is_affine(points: FloatArray, facets: IntArray) -> bool:
    """Whether all facets are flat parallelograms or triangles with their middle nodes in the middle."""
    reference = face_element(facets)
    corner = points[facets]
    a, b, c = corner[:, 0], corner[:, 1], corner[:, n_corner(facets) - 1]
    s, t = reference.nodes[:, :1], reference.nodes[:, 1:]
    plane = a[:, None] + s * (b - a)[:, None] + t * (c - a)[:, None]
    return bool(np.abs(corner - plane).max() <= 1e-9 * np.ptp(corner, axis=1).max())


def _local(
    reference: ReferenceElement, corner: FloatArray, frame: tuple[FloatArray, FloatArray], plane: FloatArray
) -> FloatArray:
    """Reference coordinates xi of points given in the plane of the affine map ``frame``, (n, 2), by Newton."""
    tangents, centre = frame
    xi = plane.copy()
    for _ in range(_NEWTON_STEPS):
        n, dn = reference.shape(xi)
        at = np.einsum("pdi,pi->pd", tangents, np.einsum("pa,pai->pi", n, corner) - centre) + _centre(reference)
        jacobian = np.einsum("pdi,pae,pai->pde", tangents, dn, corner, optimize=True)
        step = np.linalg.solve(jacobian, (plane - at)[..., None])[..., 0]
        # Corners far outside serve the clipping only; their exact place does not matter, that they stay outside does.
        xi = np.clip(xi + step, -1.0, 2.0)
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    return xi
