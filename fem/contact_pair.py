"""The contact points of two surfaces: which slave points find a partner on the master, and which lie out of reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.contact import Contact, ContactLaw
from fem.errors import FemInputError
from fem.pairing import Facing, Projection, SurfacePoints, facet_sizes, mean_size, project
from fem.reach import LeftOut
from fem.segmentation import segment_points

_OVER_KINK = 0.05
"""Share of a master facet by which the closest point may miss it where two facets meet at an angle."""

_SLIDE = 0.1
"""Slip that counts as small, in sizes of the master facet: the force is then misplaced by at most that distance."""

WIDE = 0.05
"""Default reach before a surface, in diagonals of the smaller one: of a body of radius R a width of about 0.3 R, beyond
that of any contact between half-spaces, whatever the mesh."""


@dataclass(frozen=True)
class Reach:
    """Gaps (m) at which points are paired: from -``depth`` to ``front``; up to ``watch`` they are watched."""

    front: float
    depth: float
    watch: float


def pair_reach(points: FloatArray, slave: IntArray, master: IntArray, given: float | None, *, bonded: bool) -> Reach:
    """The reach of a pair: what is ``given``, before the master and behind it, or the default, m.

    The default is half the mean slave facet; before the master of a pair that is not ``bonded`` at least ``WIDE``,
    since curved surfaces close gaps that have nothing to do with the mesh. Behind the master it stays small, for there
    lie the far sides of thin parts.
    """
    size = min(float(np.linalg.norm(np.ptp(points[facets].reshape(-1, 3), axis=0))) for facets in (slave, master))
    close = 0.5 * mean_size(points, slave)
    wide = max(WIDE * size, close)
    if given is not None:
        return Reach(given, given, max(2.0 * given, wide))
    return Reach(close if bonded else wide, close, 2.0 * wide)


def contact_pair(
    name: str,
    points: FloatArray,
    surfaces: tuple[IntArray, IntArray],
    law: ContactLaw,
    *,
    reach: float | None = None,
    bonded: bool = False,
) -> Contact:
    """Contact between two facet sets of one model.

    Parameters
    ----------
    points : (n_node, 3) all nodes of the model, m.
    surfaces : slave and master, (n_facet, n_face_local) global node numbers; the integration points lie on the slave.
    reach : largest initial distance of a pair in m; default see ``pair_reach``. Slave points without a partner that
        faces them are no contact points.
    """
    slave, master = surfaces
    limit = pair_reach(points, slave, master, reach, bonded=bonded)
    source = segment_points(points, slave, master, limit.watch)
    target = _partners(points, source, master, limit)
    gap = np.einsum("gi,gi->g", source.points - target.points, target.normals)
    distance = np.linalg.norm(source.points - target.points, axis=1)
    faces = np.flatnonzero(target.found)
    faces = faces[~_behind_itself(points, slave, source.taken(faces), gap[faces], 0.01 * limit.depth)]
    near = np.zeros(len(gap), dtype=bool)
    near[faces] = (distance <= np.where(gap > 0.0, limit.front, limit.depth))[faces]
    if not near.any():
        raise _nothing_near(name, limit, gap[faces])
    left = faces[~near[faces]]
    normal = target.normals[near]
    frame = np.stack([normal, *_tangents(normal)], axis=1)
    sizes = [facet_sizes(points, facets) for facets in surfaces]
    count = int(near.sum())
    return Contact(
        _operator(source, target, np.flatnonzero(near), frame, 3 * len(points)),
        source.area[near],
        gap[near],
        np.tile([law.normal_penalty, law.tangential_penalty, law.friction], (count, 1)),
        source.points[near],
        (name,),
        np.zeros(count, dtype=np.int64),
        sizes[0][source.facet[near]],
        _SLIDE * sizes[1][target.facet[near]],
        frame,
        np.array([[(size**2).sum() for size in sizes]]),
        LeftOut(
            _operator(source, target, left, target.normals[left, None], 3 * len(points)),
            gap[left],
            source.area[left],
            source.points[left],
            np.zeros(len(left), dtype=np.int64),
            np.array([limit.front]),
        ),
    )


def _partners(points: FloatArray, source: SurfacePoints, master: IntArray, limit: Reach) -> Projection:
    """Projections on what faces the points; on what lies deep behind them only where nothing lies before."""
    before = Facing(source.normals, limit.depth)
    target = project(points, source.points, master, limit.watch, slack=_OVER_KINK, facing=before)
    rest = np.flatnonzero(~target.found)
    if len(rest):
        anywhere = Facing(source.normals[rest], limit.watch)
        behind = project(points, source.points[rest], master, limit.watch, slack=_OVER_KINK, facing=anywhere)
        for name, values in vars(target).items():
            values[rest] = getattr(behind, name)
    return target


def _nothing_near(name: str, limit: Reach, seen: FloatArray) -> FemInputError:
    advice = "check that the surfaces face each other, or enlarge the reach"
    if len(seen):
        nearest = float(seen[np.abs(seen).argmin()])
        side = f"{nearest:.3g} m before" if nearest > 0.0 else f"{-nearest:.3g} m behind"
        advice = f"the nearest point that faces it lies {side} it: enlarge the reach if they belong together"
    where = f"contact {name}"
    return FemInputError("no slave point finds the master surface", where=where, value=limit.front, advice=advice)


def _behind_itself(points: FloatArray, slave: IntArray, at: SurfacePoints, gap: FloatArray, least: float) -> BoolArray:
    """True for points (n,) behind the master with the far side of the slave between: no interference, a thin part.

    Points less than ``least`` m behind it are taken as they are.
    """
    hidden = np.zeros(len(gap), dtype=bool)
    deep = np.flatnonzero(gap < -least)
    if len(deep):
        depth = float(-gap[deep].min())
        own = project(points, at.points[deep], slave, depth, facing=Facing(at.normals[deep], depth))
        thickness = np.linalg.norm(at.points[deep] - own.points, axis=1)
        hidden[deep] = own.found & (thickness < -gap[deep])
    return hidden


def _operator(
    source: SurfacePoints, target: Projection, chosen: IntArray, frame: FloatArray, n_dof: int
) -> sp.csr_matrix:
    """Displacements of chosen slave points relative to the master along the rows of frame (n, n_row, 3)."""
    nodes = np.hstack([source.nodes[chosen], target.nodes[chosen]])
    weight = np.hstack([source.shape[chosen], -target.shape[chosen]])
    data = np.einsum("gri,ga->grai", frame, weight)
    columns = np.broadcast_to((3 * nodes[:, :, None] + np.arange(3))[:, None], data.shape)
    count = frame.shape[0] * frame.shape[1]
    rows = np.broadcast_to(np.arange(count).reshape(*frame.shape[:2], 1, 1), data.shape)
    matrix = sp.csr_matrix((data.ravel(), (rows.ravel(), columns.ravel())), shape=(count, n_dof))
    matrix.eliminate_zeros()
    return matrix


def _tangents(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit tangents; the first is the projection of the global axis farthest from the normal."""
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = axis - np.einsum("gi,gi->g", axis, normal)[:, None] * normal
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normal, first)
