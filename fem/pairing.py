"""Integration points of one surface projected on another: non-matching quadratic meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.element import ReferenceElement, reference_element

_FACE_OF_NODES = {6: "tri6", 8: "quad8", 9: "quad9"}
_NEWTON_STEPS = 12
_EDGE_TOLERANCE = 1e-6

FACING = 0.5
"""Surfaces face each other where their normals are within 60 degrees of opposite."""

_WIDER = 1.5
"""Growth of the box of a facet in which projections are looked for: bulges and what may miss the facet."""

_CHUNK = 256
"""Facets whose neighbours are listed at a time: a wide reach lists many before few are kept."""


@dataclass(frozen=True)
class SurfacePoints:
    """Integration points of a surface.

    Attributes
    ----------
    points, normals : (n_point, 3) m and outward unit normals.
    area : (n_point,) m^2.
    nodes, shape : (n_point, n_local) node numbers and shape functions there.
    facet : (n_point,) number of the facet that the point lies on.
    """

    points: FloatArray
    normals: FloatArray
    area: FloatArray
    nodes: IntArray
    shape: FloatArray
    facet: IntArray

    def joined(self, other: SurfacePoints) -> SurfacePoints:
        """These points, then the others; facets of one kind."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return SurfacePoints(*(np.concatenate(pair) for pair in pairs))

    def taken(self, index: IntArray) -> SurfacePoints:
        """The points with these numbers."""
        return SurfacePoints(*(values[index] for values in vars(self).values()))


@dataclass(frozen=True)
class Projection:
    """Closest points on a master surface; rows with ``found`` False have none inside the search distance."""

    points: FloatArray
    normals: FloatArray
    nodes: IntArray
    shape: FloatArray
    facet: IntArray
    found: BoolArray


def face_element(facets: IntArray) -> ReferenceElement:
    """The quadratic face element with as many nodes as the facets have columns."""
    return reference_element(_FACE_OF_NODES[facets.shape[1]])


def n_corner(facets: IntArray) -> int:
    """Number of corners of the facets, whose nodes come first."""
    return 3 if facets.shape[1] == 6 else 4


def surface_points(points: FloatArray, facets: IntArray) -> SurfacePoints:
    """Integration points of facets (n_facet, n_local) over nodes at ``points`` (n_node, 3)."""
    x, w = face_element(facets).mass_rule()
    n, dn = face_element(facets).shape(x)
    corner = points[facets]
    position = np.einsum("qa,fai->fqi", n, corner)
    normal = np.cross(*np.moveaxis(np.einsum("qad,fai->dfqi", dn, corner), 0, 0))
    size = np.linalg.norm(normal, axis=-1)
    count = facets.shape[0] * len(w)
    return SurfacePoints(
        position.reshape(count, 3),
        (normal / size[..., None]).reshape(count, 3),
        (size * w).reshape(count),
        np.repeat(facets, len(w), axis=0),
        np.tile(n, (len(facets), 1)),
        np.repeat(np.arange(len(facets)), len(w)),
    )


def facet_sizes(points: FloatArray, facets: IntArray) -> FloatArray:
    """Square roots of the facet areas, (n_facet,) m."""
    at = surface_points(points, facets)
    return np.sqrt(np.bincount(at.facet, at.area, len(facets)))


def mean_size(points: FloatArray, facets: IntArray) -> float:
    """Square root of the mean facet area, m."""
    return float(np.sqrt(surface_points(points, facets).area.sum() / len(facets)))


def points_on(
    points: FloatArray, facets: IntArray, facet: IntArray, xi: FloatArray, weights: FloatArray
) -> SurfacePoints:
    """Points on the facets with numbers ``facet`` (n_point,) at reference coordinates xi (n_point, 2).

    ``weights`` (n_point,) are areas in reference coordinates.
    """
    n, dn = face_element(facets).shape(xi)
    nodes = facets[facet]
    corner = points[nodes]
    normal = np.cross(*np.einsum("pad,pai->dpi", dn, corner))
    size = np.linalg.norm(normal, axis=1)
    at = np.einsum("pa,pai->pi", n, corner)
    return SurfacePoints(at, normal / size[:, None], size * weights, nodes, n, facet)


@dataclass(frozen=True)
class Facing:
    """What the master must be to a target: normals within 60 degrees of opposite, gap not below -``depth``.

    ``normals`` (n_target, 3) are unit normals of the surface that the targets lie on; ``depth`` is in m.
    """

    normals: FloatArray
    depth: float


def project(
    points: FloatArray,
    targets: FloatArray,
    facets: IntArray,
    reach: float,
    *,
    slack: float = _EDGE_TOLERANCE,
    facing: Facing | None = None,
) -> Projection:
    """Closest points of ``targets`` (n_target, 3) on facets over nodes at ``points``.

    Newton on (x(xi) - x_t) . dx/dxi = 0 for every facet that may come within ``reach`` (m) of a target; a projection
    counts when xi lies in the facet and its distance is at most ``reach``; where none does, one that misses the facet
    by less than ``slack`` in reference coordinates: a target over the kink between two facets. With ``facing`` only
    projections on what faces the targets count. Wriggers, Computational Contact Mechanics, sec. 4.1.
    """
    found = np.zeros(len(targets), dtype=bool)
    chosen, xi = np.zeros(len(targets), dtype=np.int64), np.zeros((len(targets), 2))
    # Near facets first: targets that touch cost the same whatever the reach.
    for distance in sorted({min(0.5 * mean_size(points, facets), reach), reach}):
        left = np.flatnonzero(~found)
        own = None if facing is None else Facing(facing.normals[left], facing.depth)
        index, facet, local = _nearest(points, targets[left], facets, distance, (slack, own))
        found[left[index]], chosen[left[index]], xi[left[index]] = True, facet, local
    reference = face_element(facets)
    corner = points[facets[chosen]]
    n = reference.shape(xi)[0]
    at = np.einsum("ta,tai->ti", n, corner)
    return Projection(at, _normals(reference, corner, xi), facets[chosen], n, chosen, found)


def _nearest(
    points: FloatArray, targets: FloatArray, facets: IntArray, reach: float, rule: tuple[float, Facing | None]
) -> tuple[IntArray, IntArray, FloatArray]:
    """Numbers of the targets that find a facet within ``reach``, the facet, and the place on it (n, 2)."""
    reference, (slack, facing) = face_element(facets), rule
    target, facet = _candidates(points[facets], targets, reach)
    corner = points[facets[facet]]
    local = _closest(reference, corner, targets[target])
    offset = targets[target] - np.einsum("ta,tai->ti", reference.shape(local)[0], corner)
    distance = np.linalg.norm(offset, axis=1)
    beside = ~_inside(reference, local, _EDGE_TOLERANCE)
    usable = (~beside | _inside(reference, local, slack)) & (distance <= reach)
    if facing is not None:
        normal = _normals(reference, corner, local)
        usable &= np.einsum("ti,ti->t", normal, facing.normals[target]) < -FACING
        usable &= np.einsum("ti,ti->t", normal, offset) >= -facing.depth
    # Nearest first; of equally near facets (a shared edge) the lower number, so that the choice is reproducible.
    chosen = np.flatnonzero(usable)
    order = chosen[np.lexsort((facet[chosen], distance[chosen], beside[chosen], target[chosen]))]
    index, first = np.unique(target[order], return_index=True)
    return index, facet[order[first]], local[order[first]]


def _normals(reference: ReferenceElement, corner: FloatArray, xi: FloatArray) -> FloatArray:
    """Unit normals of facets (n, n_local, 3) at xi (n, 2)."""
    normal = np.cross(*np.einsum("tad,tai->dti", reference.shape(xi)[1], corner))
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def _candidates(corner: FloatArray, targets: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Target and facet numbers of all pairs that may project on each other within ``reach``.

    Bounding spheres of the facets (n_facet, n_local, 3) first: quadratic facets bulge out of their nodes by less than
    their half size, hence the sphere of twice the node radius. Of those at a distance, targets stay that lie over the
    box of the facet, wider by what its normals spread at that height.
    """
    centre = corner.mean(axis=1)
    radius = 2.0 * np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1)
    axes, spread = _axes(corner)
    extent = np.abs(np.einsum("fad,fid->fai", corner - centre[:, None], axes)).max(axis=1)
    tree = cKDTree(targets)
    parts = [(np.empty(0, dtype=np.int64),) * 2]
    for start in range(0, len(corner), _CHUNK):
        some = slice(start, start + _CHUNK)
        near = tree.query_ball_point(centre[some], radius[some] + reach)
        f = np.repeat(np.arange(start, start + len(near)), [len(found) for found in near])
        t = np.concatenate([np.empty(0), *near]).astype(np.int64)
        place = np.abs(np.einsum("pd,pid->pi", targets[t] - centre[f], axes[f]))
        aside = (_WIDER * extent[f, :2] + (spread[f] * place[:, 2])[:, None] >= place[:, :2]).all(axis=1)
        parts.append((t[aside], f[aside]))
    target, facet = (np.concatenate(part) for part in zip(*parts, strict=True))
    return target, facet


def _axes(corner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frames of facets (n_facet, 3, 3), two rows along them and their normal, and the spread of their normals.

    The spread is the tangent of the largest angle between a normal at a node and that of the frame, infinite from 60
    degrees on.
    """
    reference = reference_element(_FACE_OF_NODES[corner.shape[1]])
    along = np.einsum("ad,fai->dfi", reference.shape(reference.nodes.mean(axis=0)[None])[1][0], corner)
    normal = np.cross(*along)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    first = along[0] / np.linalg.norm(along[0], axis=1)[:, None]
    count = len(corner)
    nodes = np.tile(reference.nodes, (count, 1))
    own = _normals(reference, np.repeat(corner, len(reference.nodes), axis=0), nodes)
    cosine = np.einsum("fai,fi->fa", own.reshape(count, -1, 3), normal).min(axis=1)
    spread = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, FACING)
    return np.stack([first, np.cross(normal, first), normal], axis=1), np.where(cosine > FACING, spread, np.inf)


def _closest(reference: ReferenceElement, corner: FloatArray, targets: FloatArray) -> FloatArray:
    """Gauss-Newton for the closest point of each target on its own facet, (n_target, 2) reference coordinates."""
    xi = np.full((len(targets), 2), 1.0 / 3.0 if reference.name == "tri6" else 0.5)
    for _ in range(_NEWTON_STEPS):
        n, dn = reference.shape(xi)
        offset = np.einsum("ta,tai->ti", n, corner) - targets
        tangent = np.einsum("tad,tai->tdi", dn, corner)
        metric = np.einsum("tdi,tei->tde", tangent, tangent)
        step = np.linalg.solve(metric, np.einsum("tdi,ti->td", tangent, offset)[..., None])[..., 0]
        xi = np.clip(xi - step, -1.0, 2.0)
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    return xi


def _inside(reference: ReferenceElement, xi: FloatArray, slack: float) -> BoolArray:
    low = np.all(xi >= -slack, axis=1)
    if reference.name == "tri6":
        return np.asarray(low & (xi.sum(axis=1) <= 1.0 + slack))
    return np.asarray(low & np.all(xi <= 1.0 + slack, axis=1))
