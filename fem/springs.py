"""Springs to the ground and between points, elastic foundations under surfaces, and masses at points.

All are linear in the displacement: rows B, one stiffness k per row, K = B' k B, forces k B u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.body import locate
from fem.errors import FemInputError
from fem.finite_values import finite_number, finite_vector
from fem.interfaces import default_penalty
from fem.loads import Assembly, Vector
from fem.locate_point import cell_of_point
from fem.names import unlike
from fem.pairing import surface_points

RIGID = 1000.0
"""Default bed in multiples of E / h: it gives way like a thousandth of a facet size of material."""

_SAME = 1e-9
"""Largest difference of shape functions at which two ends of a spring are one point: rounding."""


@dataclass(frozen=True)
class Foundation:
    """An elastic bed under a surface "<body>.<surface>": tractions -k u in Pa, in tension too.

    Attributes
    ----------
    normal : Pa/m along the normals of the undeformed surface; None: ``RIGID`` times E / h, which holds a plane of
        symmetry of any direction, a cylinder radially, a sphere.
    tangential : Pa/m across them; 0 lets the surface slide.
    """

    name: str
    surface: str
    normal: float | None = None
    tangential: float = 0.0


@dataclass(frozen=True)
class Spring:
    """Stiffness (k_x, k_y, k_z) in N/m between a material point (m) and the ground, or a second material point ``to``.

    The force is -k times the (relative) displacement along each axis, whatever the distance of the points. ``body``
    and ``to_body`` name the bodies that they lie on, which is needed where bodies touch.
    """

    name: str
    point: Vector
    stiffness: Vector
    to: Vector | None = None
    body: str | None = None
    to_body: str | None = None


@dataclass(frozen=True)
class PointMass:
    """A mass in kg that moves with a material point (m), without rotary inertia; ``body`` where two touch there."""

    name: str
    point: Vector
    mass: float
    body: str | None = None


@dataclass(frozen=True)
class SpringSet:
    """All springs and foundations of a model.

    Attributes
    ----------
    operator : B, (n_row, n_dof); stiffness : (n_row,) N/m.
    names : of the springs and foundations; owner : (n_row,) index into them.
    axes : (n_row, 3) unit vectors along which the rows act.
    """

    operator: sp.csr_matrix
    stiffness: FloatArray
    names: tuple[str, ...]
    owner: IntArray
    axes: FloatArray

    @property
    def matrix(self) -> sp.csr_matrix:
        """B' k B, (n_dof, n_dof) N/m."""
        return (self.operator.T @ sp.diags(self.stiffness) @ self.operator).tocsr()

    def forces(self, u: FloatArray) -> dict[str, FloatArray]:
        """Resultant (3,) in N with which each acts on its surface or ``point`` at u (n_dof,) m, by name."""
        pull = -(self.stiffness * (self.operator @ u))[:, None] * self.axes
        return {name: np.asarray(pull[self.owner == number].sum(axis=0)) for number, name in enumerate(self.names)}

    def resultants(self) -> sp.csr_matrix:
        """R (3 n_spring, n_dof) N/m: the forces at u are R u, three rows for each spring in order of ``names``."""
        rows = (3 * self.owner[:, None] + np.arange(3)).ravel()
        columns = np.repeat(np.arange(len(self.owner)), 3)
        values = (-self.stiffness[:, None] * self.axes).ravel()
        shape = (3 * len(self.names), len(self.owner))
        return (sp.csr_matrix((values, (rows, columns)), shape=shape) @ self.operator).tocsr()


Elastic = Foundation | Spring


def spring_set(elastic: Sequence[Elastic], assembly: Assembly) -> SpringSet:
    """Rows and stiffnesses.

    Unknown names, one name twice, points outside all bodies and negative numbers raise ``FemInputError``.
    """
    unlike([item.name for item in elastic], "springs")
    n_dof = 3 * len(assembly.points)
    rows, stiffness, axes = [sp.csr_matrix((0, n_dof))], [np.empty(0)], [np.empty((0, 3))]
    for item in elastic:
        operator, k, along = _bed(item, assembly) if isinstance(item, Foundation) else _spring(item, assembly)
        if not (np.isfinite(k).all() and (k >= 0.0).all()):
            value = item.stiffness if isinstance(item, Spring) else (item.normal, item.tangential)
            raise FemInputError("stiffness must not be negative", where=f"spring {item.name}", value=value)
        rows.append(operator[k > 0.0])
        stiffness.append(k[k > 0.0])
        axes.append(along[k > 0.0])
    owner = np.repeat(np.arange(len(elastic)), [len(k) for k in stiffness[1:]])
    names = tuple(item.name for item in elastic)
    return SpringSet(sp.vstack(rows).tocsr(), np.concatenate(stiffness), names, owner, np.vstack(axes))


def _bed(bed: Foundation, assembly: Assembly) -> tuple[sp.csr_matrix, FloatArray, FloatArray]:
    where = f"spring {bed.name}"
    index, surface = locate(assembly.bodies, bed.surface, where=where, surface=True)
    body, offset = assembly.bodies[index], assembly.offsets[index]
    facets = body.mesh.surface(surface)
    at = surface_points(assembly.points, facets + offset)
    normal = (
        RIGID * default_penalty(body, facets)
        if bed.normal is None
        else finite_number(bed.normal, "normal", where=where)
    )
    tangential = finite_number(bed.tangential, "tangential", where=where)
    frame = np.stack([at.normals, *_tangents(at.normals)], axis=1)
    k = at.area[:, None] * np.array([normal, tangential, tangential])
    rows = np.repeat(np.arange(3 * len(at.area)), 3 * at.nodes.shape[1])
    columns = np.broadcast_to((3 * at.nodes[:, None, :, None] + np.arange(3)), (*frame.shape[:2], at.nodes.shape[1], 3))
    values = at.shape[:, None, :, None] * frame[:, :, None, :]
    shape = (3 * len(at.area), 3 * len(assembly.points))
    operator = sp.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=shape)
    return operator, k.ravel(), frame.reshape(-1, 3)


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across every normal (n, 3)."""
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normals, first)


def _spring(spring: Spring, assembly: Assembly) -> tuple[sp.csr_matrix, FloatArray, FloatArray]:
    where = f"spring {spring.name}"
    operator = _point_rows((spring.point, spring.body), assembly, where)
    if spring.to is not None:
        operator = operator - _point_rows((spring.to, spring.to_body), assembly, where)
        if abs(operator).max() <= _SAME:
            advice = "let its ends lie on two bodies (body, to_body) or apart"
            raise FemInputError("both ends are the same point", where=where, value=tuple(spring.to), advice=advice)
    elif spring.to_body is not None:
        raise FemInputError("to_body without a point to", where=where, value=spring.to_body)
    return operator, finite_vector(spring.stiffness, "the stiffness", where=where), np.eye(3)


def _point_rows(place: tuple[Vector, str | None], assembly: Assembly, where: str) -> sp.csr_matrix:
    """Displacement of a material point on a body, (3, n_dof)."""
    point, body = place
    found = cell_of_point(assembly.bodies, assembly.offsets, point, where=where, body=body)
    axis = np.arange(3)
    columns = 3 * found.nodes[None, :] + axis[:, None]
    rows = np.broadcast_to(axis[:, None], columns.shape)
    values = np.broadcast_to(found.shape, columns.shape)
    return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(3, 3 * len(assembly.points)))


def point_mass_matrix(masses: Sequence[PointMass], assembly: Assembly) -> sp.csr_matrix:
    """Sum of m N' N over the masses, (n_dof, n_dof) kg; a mass that is not positive raises ``FemInputError``."""
    n_dof = 3 * len(assembly.points)
    total = sp.csr_matrix((n_dof, n_dof))
    for item in masses:
        where = f"point mass {item.name}"
        mass = finite_number(item.mass, "the mass", where=where)
        if not mass > 0.0:
            raise FemInputError("mass must be positive", where=where, value=item.mass)
        rows = _point_rows((item.point, item.body), assembly, where)
        total = total + mass * (rows.T @ rows)
    return total.tocsr()


def lumped_point_masses(masses: Sequence[PointMass], assembly: Assembly) -> FloatArray:
    """The masses shared out to the nodes of their cells by N^2, (n_node,) kg: none is negative, their sum is kept."""
    nodal = np.zeros(len(assembly.points))
    for item in masses:
        where = f"point mass {item.name}"
        found = cell_of_point(assembly.bodies, assembly.offsets, item.point, where=where, body=item.body)
        nodal[found.nodes] += float(item.mass) * found.shape**2 / (found.shape @ found.shape)
    return nodal
