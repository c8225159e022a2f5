"""Solid bolts: the shank cut at a section whose two faces are drawn together until the wanted force is reached.

On the section tau = k (u_head - u_thread + delta a): delta (m) is the shortening along the axis a. While a bolt is
tightened delta follows from the wanted force; then it is locked, and the force changes with the load on the joint. The
cut runs along faces of cells, flat or not (pretension sections of ANSYS and Abaqus work alike).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.body import Body
from fem.bounds import real
from fem.contact import Contact
from fem.errors import FemInputError
from fem.finite_values import finite_vector
from fem.interfaces import Tie
from fem.loads import Vector
from fem.mesh import Mesh
from fem.names import nearest
from fem.supports import AXES

THREAD_SIDE, HEAD_SIDE = "section_thread", "section_head"


class PreloadWarning(UserWarning):
    """Something is computed with bolts that nothing has tightened."""


@dataclass(frozen=True)
class Bolt:
    """A bolt body and the force that tightening leaves in its shank.

    Attributes
    ----------
    body : name of the meshed bolt; its thread is bonded by a ``Tie`` and its head pressed on by a ``Pair``.
    force : N, tension positive.
    axis : "x", "y", "z", or a direction (x, y, z) of any length, such as head point less thread point; either way.
    section : coordinate x . a along the unit vector a of the axis, m, near which the shank is cut; default the middle
        of the body.
    stiffness : of the section in multiples of E / h: 1000 adds a thousandth of a facet size to the length of the bolt.
    """

    name: str
    body: str
    force: float
    axis: str | Vector = "y"
    section: float | None = None
    stiffness: float = 1000.0

    def __post_init__(self) -> None:
        where = f"bolt {self.name}"
        if not 0.0 < real(self.force) < math.inf:
            raise FemInputError("the bolt force must be positive", where=where, value=self.force)
        if isinstance(self.axis, str) and self.axis not in AXES:
            advice = "choose x, y, z or a direction (x, y, z)"
            raise FemInputError("unknown axis", where=where, value=self.axis, advice=advice)
        if not isinstance(self.axis, str) and not finite_vector(self.axis, "the axis", where=where).any():
            raise FemInputError("the axis has no direction", where=where, value=self.axis)

    @property
    def direction(self) -> FloatArray:
        """Unit vector (3,) of the axis."""
        if isinstance(self.axis, str):
            return np.asarray(np.eye(3)[AXES[self.axis]])
        given = np.asarray(self.axis, dtype=float)
        return np.asarray(given / np.linalg.norm(given))


@dataclass(frozen=True)
class BoltSet:
    """All bolts of a model; force of bolt b: Q_b u + S_b delta_b.

    Attributes
    ----------
    bolts : definitions.
    pull : Q, (n_bolt, n_dof) N/m; stiffness : S, (n_bolt,) N/m.
    shortening : delta, (n_bolt,) m; zero before tightening.
    """

    bolts: tuple[Bolt, ...]
    pull: FloatArray
    stiffness: FloatArray
    shortening: FloatArray

    @property
    def wanted(self) -> FloatArray:
        """Forces asked for, (n_bolt,) N."""
        return np.array([bolt.force for bolt in self.bolts])

    def forces(self, u: FloatArray) -> FloatArray:
        """Shank forces at u (n_dof,) or (n_dof, n_case), tension positive, (n_bolt, ...) N."""
        own = self.stiffness * self.shortening
        return np.asarray(self.pull @ u + (own if u.ndim == 1 else own[:, None]))


def warn_of_slack(bolts: BoltSet, who: str) -> None:
    """Issue ``PreloadWarning`` where bolts have not been tightened; ``who`` goes on without their forces."""
    slack = [bolt.name for bolt, delta in zip(bolts.bolts, bolts.shortening, strict=True) if delta == 0.0]
    if slack:
        advice = "solve_preload tightens them and returns the model to go on with"
        warnings.warn(f"{who}: bolts {', '.join(slack)} are not tightened; {advice}", PreloadWarning, stacklevel=3)


def cut_bolts(bodies: Sequence[Body], bolts: Sequence[Bolt]) -> tuple[tuple[Body, ...], tuple[Tie, ...]]:
    """Bodies with their shanks cut and the ties that close the cuts again; an unknown body raises ``FemInputError``."""
    by_name = {body.name: body for body in bodies}
    ties = []
    for bolt in bolts:
        if bolt.body not in by_name:
            advice = nearest(bolt.body, by_name, "bodies are")
            raise FemInputError("unknown body", where=f"bolt {bolt.name}", value=bolt.body, advice=advice)
        body = by_name[bolt.body]
        if HEAD_SIDE in body.mesh.surfaces:
            raise FemInputError("two bolts in one body", where=f"bolt {bolt.name}", value=bolt.body)
        by_name[bolt.body] = replace(body, mesh=_cut(body.mesh, bolt))
        sides = (f"{bolt.body}.{HEAD_SIDE}", f"{bolt.body}.{THREAD_SIDE}")
        ties.append(Tie(bolt.name, *sides, stiffness=bolt.stiffness))
    return tuple(by_name.values()), tuple(ties)


def bolt_set(bolts: Sequence[Bolt], sections: Sequence[Contact], n_dof: int) -> BoltSet:
    """Q = B' w k a and S = sum w k of every section, from the bonds that close the cuts."""
    pull, stiffness = [], []
    for bolt, bond in zip(bolts, sections, strict=True):
        axis = bond.frame @ bolt.direction
        weighted = bond.area[:, None] * bond.law[:, [0, 1, 1]] * axis
        pull.append(bond.operator.T @ weighted.ravel())
        stiffness.append(float((weighted * axis).sum()))
    none = np.zeros((0, n_dof))
    return BoltSet(tuple(bolts), np.array(pull) if pull else none, np.array(stiffness), np.zeros(len(pull)))


def _cut(mesh: Mesh, bolt: Bolt) -> Mesh:
    """The mesh with nodes doubled where cells before and behind the section meet, and both faces of the cut named."""
    along = mesh.points @ bolt.direction
    at = 0.5 * (along.min() + along.max()) if bolt.section is None else bolt.section
    ahead = along[mesh.cells].mean(axis=1) > at
    if ahead.all() or not ahead.any():
        value, advice = at, f"the body lies between {along.min():g} and {along.max():g} m along {bolt.axis}"
        raise FemInputError("the section misses the shank", where=f"bolt {bolt.name}", value=value, advice=advice)
    behind_nodes = np.zeros(len(mesh.points), dtype=bool)
    behind_nodes[mesh.cells[~ahead]] = True
    ahead_nodes = np.zeros(len(mesh.points), dtype=bool)
    ahead_nodes[mesh.cells[ahead]] = True
    shared = np.flatnonzero(behind_nodes & ahead_nodes)
    number = np.arange(len(mesh.points))
    number[shared] = len(mesh.points) + np.arange(len(shared))
    cells = np.where(ahead[:, None], number[mesh.cells], mesh.cells)
    points = np.vstack([mesh.points, mesh.points[shared]])
    head, thread = _faces_on_cut(mesh, ahead)
    surfaces = {name: _renumbered(mesh, facets, ahead, number) for name, facets in mesh.surfaces.items()}
    surfaces |= {HEAD_SIDE: number[head], THREAD_SIDE: thread}
    sets = {name: np.union1d(nodes, number[nodes]) for name, nodes in mesh.node_sets.items()}
    return Mesh(points, cells, mesh.element, surfaces, sets)


def _keys(mesh: Mesh, facets: IntArray) -> list[tuple[int, ...]]:
    corners = 3 if mesh.element == "tet10" else 4
    return [tuple(row) for row in np.sort(facets[:, :corners], axis=1).tolist()]


def _facets_of(mesh: Mesh, chosen: BoolArray) -> IntArray:
    return Mesh(mesh.points, mesh.cells[chosen], mesh.element, {}).facets()


def _faces_on_cut(mesh: Mesh, ahead: BoolArray) -> tuple[IntArray, IntArray]:
    """Facets of the cells ahead that cells behind share, and the same facets as those behind see them."""
    sides = [_facets_of(mesh, chosen) for chosen in (ahead, ~ahead)]
    keys = [_keys(mesh, facets) for facets in sides]
    common = set(keys[0]) & set(keys[1])
    head, thread = (facets[[key in common for key in side_keys]] for facets, side_keys in zip(sides, keys, strict=True))
    return head, thread


def _renumbered(mesh: Mesh, facets: IntArray, ahead: BoolArray, number: IntArray) -> IntArray:
    """Facets of a surface with the new node numbers where they belong to cells ahead."""
    front = set(_keys(mesh, _facets_of(mesh, ahead)))
    moved = np.array([key in front for key in _keys(mesh, facets)], dtype=bool)
    return np.where(moved[:, None], number[facets], facets)
