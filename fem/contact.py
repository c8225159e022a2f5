"""Frictional interfaces: Gauss-point-to-surface contact between named surfaces, small sliding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.errors import FemInputError
from fem.friction import traction_tangents, tractions
from fem.reach import LeftOut, joined_left_out


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
    surface : (n_pair, 2) m^2, area of the whole slave and master; left_out : slave points beyond the reach.
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
    surface: FloatArray
    left_out: LeftOut

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

    def nearest(self, relative: FloatArray) -> BoolArray:
        """Points (n_point,) with gaps within half a facet of the smallest of their pair; relative (3 n_point,) m.

        The facet is that of the nearest point: far ones of a graded mesh are larger than the contact.
        """
        gap = self.initial_gap + relative[::3]
        near = np.zeros(self.n_point, dtype=bool)
        for number in range(len(self.names)):
            at = np.flatnonzero(self.pair == number)
            first = at[gap[at].argmin()]
            near[at] = gap[at] <= max(gap[first], 0.0) + 0.5 * self.facet_size[first]
        return near

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
        """Work of friction over one increment sum w tau_t . (s_p_new - s_p), (n_case,) J; open points do none.

        The traction is that at the end of the increment, as the equation of a time step takes it: of first order where
        the pressure changes, see ``fem.friction_work`` for load steps.
        """
        tangential = traction.reshape(self.n_point, 3, traction.shape[1])[:, 1:, :]
        return np.asarray(np.einsum("g,gdc,gdc->c", self.area, tangential, new_slip - slip))

    def _assemble(self, blocks: FloatArray) -> sp.csr_matrix:
        index = np.arange(self.n_point)
        weighted = blocks * self.area[:, None, None]
        D = sp.bsr_matrix((weighted, index, np.arange(self.n_point + 1)), shape=(3 * self.n_point,) * 2)
        return (self.operator.T @ D.tocsr() @ self.operator).tocsr()


def join(contacts: tuple[Contact, ...], n_dof: int) -> Contact:
    """All pairs of a model as one contact; none gives an empty one."""
    if not contacts:
        empty = np.empty(0)
        rows, none = np.empty((0, 3)), np.empty(0, dtype=np.int64)
        frames, areas, left_out = np.empty((0, 3, 3)), np.empty((0, 2)), joined_left_out((), n_dof)
        operator = sp.csr_matrix((0, n_dof))
        return Contact(operator, empty, empty, rows, rows, (), none, empty, empty, frames, areas, left_out)
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
        np.concatenate([c.surface for c in contacts]),
        joined_left_out(tuple(c.left_out for c in contacts), n_dof),
    )
