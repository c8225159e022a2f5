"""Frictional interfaces: Gauss-point-to-surface contact between named surfaces, small sliding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.errors import FemInputError
from fem.friction import traction_tangents, tractions
from fem.pairing import Projection, SurfacePoints, facet_sizes, mean_size, project
from fem.segmentation import segment_points

_FACING = 0.5
"""Surfaces face each other where their normals are within 60 degrees of opposite."""

_OVER_KINK = 0.05
"""Share of a master facet by which the closest point may miss it where two facets meet at an angle."""

_SLIDE = 0.1
"""Slip that counts as small, in sizes of the master facet: the force is then misplaced by at most that distance."""


@dataclass(frozen=True)
class ContactLaw:
    """Penalties in Pa/m and the Coulomb coefficient."""

    normal_penalty: float
    tangential_penalty: float
    friction: float

    def __post_init__(self) -> None:
        if not (self.normal_penalty > 0.0 and self.tangential_penalty > 0.0):
            value = (self.normal_penalty, self.tangential_penalty)
            raise FemInputError("penalties must be positive", where="contact", value=value)
        if not self.friction >= 0.0:
            raise FemInputError("friction coefficient must not be negative", where="contact", value=self.friction)


@dataclass(frozen=True)
class ContactState:
    """Tractions and history of all points for all cases.

    traction (3 n_point, n_case) Pa in the order normal, tangent 1, tangent 2; slip (n_point, 2, n_case) m; status
    (n_point, n_case) 0 open, 1 stick, 2 slip.
    """

    traction: FloatArray
    slip: FloatArray
    status: IntArray


@dataclass(frozen=True)
class Contact:
    """All contact points of a model as one linear operator and one law per point.

    With small sliding gap and slip are linear in the displacement: (g, s_1, s_2) = (g_0, 0, 0) + B u.

    Attributes
    ----------
    operator : B, (3 n_point, n_dof) sparse, rows normal, tangent 1, tangent 2 of each point.
    area : (n_point,) m^2; initial_gap : (n_point,) m; law : (n_point, 3) k_n, k_t, mu.
    points : (n_point, 3) m; names : pairs; pair : (n_point,) index into names.
    facet_size : (n_point,) m, slave; slide_limit : (n_point,) m, slip up to which the frozen projection serves.
    frame : (n_point, 3, 3) rows normal (out of the master), tangent 1, tangent 2.
    """

    operator: sp.csr_matrix
    area: FloatArray
    initial_gap: FloatArray
    law: FloatArray
    points: FloatArray
    names: tuple[str, ...]
    pair: IntArray
    facet_size: FloatArray
    slide_limit: FloatArray
    frame: FloatArray

    @property
    def n_point(self) -> int:
        """Number of contact points."""
        return len(self.area)

    def no_slip(self, n_case: int) -> FloatArray:
        """Slip history of an untouched interface, (n_point, 2, n_case)."""
        return np.zeros((self.n_point, 2, n_case))

    def relative(self, u: FloatArray) -> FloatArray:
        """Relative displacements B u, (3 n_point, n_case) m."""
        return np.ascontiguousarray(self.operator @ u)

    def evaluate(self, relative: FloatArray, slip: FloatArray) -> ContactState:
        """Tractions, new slip and status from relative displacements and the slip history."""
        traction = np.empty_like(relative)
        new_slip = np.empty_like(slip)
        status = np.empty((self.n_point, relative.shape[1]), dtype=np.int64)
        tractions(self.initial_gap, self.law, relative, slip, traction, new_slip, status)
        return ContactState(traction, new_slip, status)

    def force(self, traction: FloatArray) -> FloatArray:
        """Nodal forces B' (w tau), (n_dof, n_case) N."""
        return np.asarray(self.operator.T @ (np.repeat(self.area, 3)[:, None] * traction))

    def tangent(self, u: FloatArray, slip: FloatArray, *, symmetric: bool = False) -> sp.csr_matrix:
        """Consistent tangent B' w D B at u (n_dof,), slip (n_point, 2), N/m; unsymmetric where points slip.

        ``symmetric`` leaves out how the limit of friction follows the pressure: semidefinite, for preconditioners.
        """
        blocks = np.empty((self.n_point, 3, 3))
        traction_tangents(self.initial_gap, self.law, self.operator @ u, slip, blocks)
        if symmetric:
            blocks[:, 1:, 0] = 0.0
        return self._assemble(blocks)

    def stick_tangent(self, status: IntArray) -> sp.csr_matrix:
        """Tangent with every closed point stuck: k_n normal, k_t tangential; status (n_point,)."""
        blocks = np.zeros((self.n_point, 3, 3))
        closed = status > 0
        blocks[closed, 0, 0] = self.law[closed, 0]
        blocks[closed, 1, 1] = blocks[closed, 2, 2] = self.law[closed, 1]
        return self._assemble(blocks)

    def bilateral_traction(self, relative: FloatArray, slip: FloatArray) -> FloatArray:
        """Tractions (3 n_point,) of an interface that neither opens nor slips: what closes a gap in one step."""
        traction = relative.reshape(-1, 3).copy()
        traction[:, 0] += self.initial_gap
        traction[:, 1:] -= slip
        return (traction * self.law[:, [0, 1, 1]]).ravel()

    def stored_energy(self, traction: FloatArray) -> FloatArray:
        """Elastic energy of the penalties sum w (tau_n^2/k_n + tau_t^2/k_t)/2, (n_case,) J."""
        stiffness = self.law[:, [0, 1, 1]].ravel()
        return np.asarray(0.5 * np.repeat(self.area, 3) / stiffness @ traction**2)

    def dissipated(self, traction: FloatArray, slip: FloatArray, new_slip: FloatArray) -> FloatArray:
        """Work of friction over one increment sum w tau_t . (s_p_new - s_p), (n_case,) J; open points do none."""
        tangential = traction.reshape(self.n_point, 3, traction.shape[1])[:, 1:, :]
        return np.asarray(np.einsum("g,gdc,gdc->c", self.area, tangential, new_slip - slip))

    def dissipation_density(self, traction: FloatArray, slip: FloatArray, new_slip: FloatArray) -> FloatArray:
        """Work of friction per area of one increment tau_t . (s_p_new - s_p), (n_point, n_case) J/m^2."""
        tangential = traction.reshape(self.n_point, 3, traction.shape[1])[:, 1:, :]
        return np.asarray(np.einsum("gdc,gdc->gc", tangential, new_slip - slip))

    def _assemble(self, blocks: FloatArray) -> sp.csr_matrix:
        index = np.arange(self.n_point)
        weighted = blocks * self.area[:, None, None]
        D = sp.bsr_matrix((weighted, index, np.arange(self.n_point + 1)), shape=(3 * self.n_point,) * 2)
        return (self.operator.T @ D.tocsr() @ self.operator).tocsr()


def contact_pair(
    name: str, points: FloatArray, slave: IntArray, master: IntArray, law: ContactLaw, *, reach: float | None = None
) -> Contact:
    """Contact between two facet sets of one model.

    Parameters
    ----------
    points : (n_node, 3) all nodes of the model, m.
    slave, master : (n_facet, n_face_local) global node numbers; the integration points lie on the slave.
    reach : largest initial distance of a pair in m; default half the mean slave facet size. Slave points without a
        partner that faces them are no contact points.
    """
    distance = reach if reach is not None else 0.5 * mean_size(points, slave)
    source = segment_points(points, slave, master, distance)
    target = project(points, source.points, master, distance, slack=_OVER_KINK)
    paired = target.found & (np.einsum("gi,gi->g", source.normals, target.normals) < -_FACING)
    if not paired.any():
        advice = "check that the surfaces face each other, or enlarge the reach"
        raise FemInputError(
            "no slave point finds the master surface", where=f"contact {name}", value=distance, advice=advice
        )
    gap = np.einsum("gi,gi->g", source.points - target.points, target.normals)[paired]
    normal = target.normals[paired]
    frame = np.stack([normal, *_tangents(normal)], axis=1)
    return Contact(
        _operator(source, target, paired, frame, 3 * len(points)),
        source.area[paired],
        gap,
        np.tile([law.normal_penalty, law.tangential_penalty, law.friction], (int(paired.sum()), 1)),
        source.points[paired],
        (name,),
        np.zeros(int(paired.sum()), dtype=np.int64),
        facet_sizes(points, slave)[source.facet[paired]],
        _SLIDE * facet_sizes(points, master)[target.facet[paired]],
        frame,
    )


def join(contacts: tuple[Contact, ...], n_dof: int) -> Contact:
    """All pairs of a model as one contact; none gives an empty one."""
    if not contacts:
        empty = np.empty(0)
        rows, none = np.empty((0, 3)), np.empty(0, dtype=np.int64)
        frames = np.empty((0, 3, 3))
        return Contact(sp.csr_matrix((0, n_dof)), empty, empty, rows, rows, (), none, empty, empty, frames)
    return Contact(
        sp.vstack([c.operator for c in contacts], format="csr"),
        np.concatenate([c.area for c in contacts]),
        np.concatenate([c.initial_gap for c in contacts]),
        np.concatenate([c.law for c in contacts]),
        np.concatenate([c.points for c in contacts]),
        tuple(c.names[0] for c in contacts),
        np.concatenate([np.full(c.n_point, i, dtype=np.int64) for i, c in enumerate(contacts)]),
        np.concatenate([c.facet_size for c in contacts]),
        np.concatenate([c.slide_limit for c in contacts]),
        np.concatenate([c.frame for c in contacts]),
    )


def _operator(
    source: SurfacePoints, target: Projection, paired: BoolArray, frame: FloatArray, n_dof: int
) -> sp.csr_matrix:
    nodes = np.hstack([source.nodes[paired], target.nodes[paired]])
    weight = np.hstack([source.shape[paired], -target.shape[paired]])
    data = np.einsum("gri,ga->grai", frame, weight)
    columns = np.broadcast_to((3 * nodes[:, :, None] + np.arange(3))[:, None], data.shape)
    rows = np.broadcast_to(np.arange(3 * len(nodes)).reshape(-1, 3, 1, 1), data.shape)
    matrix = sp.csr_matrix((data.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * len(nodes), n_dof))
    matrix.eliminate_zeros()
    return matrix


def _tangents(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit tangents; the first is the projection of the global axis farthest from the normal."""
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = axis - np.einsum("gi,gi->g", axis, normal)[:, None] * normal
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normal, first)
