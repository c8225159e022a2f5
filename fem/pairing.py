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


def project(
    points: FloatArray, targets: FloatArray, facets: IntArray, reach: float, *, slack: float = _EDGE_TOLERANCE
) -> Projection:
    """Closest points of ``targets`` (n_target, 3) on facets over nodes at ``points``.

    Newton on (x(xi) - x_t) . dx/dxi = 0 for every facet that may come within ``reach`` (m) of a target; a projection
    counts when xi lies in the facet and its distance is at most ``reach``; where none does, one that misses the facet
    by less than ``slack`` in reference coordinates: a target over the kink between two facets. Wriggers,
    Computational Contact Mechanics, sec. 4.1.
    """
    reference = face_element(facets)
    target, facet = _candidates(points[facets], targets, reach)
    local = _closest(reference, points[facets[facet]], targets[target])
    n, _ = reference.shape(local)
    distance = np.linalg.norm(np.einsum("ta,tai->ti", n, points[facets[facet]]) - targets[target], axis=1)
    beside = ~_inside(reference, local, _EDGE_TOLERANCE)
    usable = np.flatnonzero((~beside | _inside(reference, local, slack)) & (distance <= reach))
    # Nearest first; of equally near facets (a shared edge) the lower number, so that the choice is reproducible.
    order = usable[np.lexsort((facet[usable], distance[usable], beside[usable], target[usable]))]
    found, first = np.unique(target[order], return_index=True)
    chosen = np.zeros(len(targets), dtype=np.int64)
    xi = np.zeros((len(targets), 2))
    chosen[found], xi[found] = facet[order[first]], local[order[first]]
    is_found = np.zeros(len(targets), dtype=bool)
    is_found[found] = True
    n, dn = reference.shape(xi)
    corner = points[facets[chosen]]
    tangents = np.einsum("tad,tai->dti", dn, corner)
    normal = np.cross(tangents[0], tangents[1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return Projection(np.einsum("ta,tai->ti", n, corner), normal, facets[chosen], n, chosen, is_found)


def _candidates(corner: FloatArray, targets: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Target and facet numbers of all pairs that may be within ``reach``: bounding spheres of corner (n_facet, ..., 3).

    Quadratic facets bulge out of their nodes by less than their half size, hence the sphere of twice the node radius.
    """
    centre = corner.mean(axis=1)
    radius = 2.0 * np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1)
    near = cKDTree(targets).query_ball_point(centre, radius + reach)
    facet = np.repeat(np.arange(len(corner)), [len(found) for found in near])
    return np.concatenate([np.empty(0), *near]).astype(np.int64), facet.astype(np.int64)


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
