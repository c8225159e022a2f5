"""A structure ready to compute: bodies, interfaces, supports and loads assembled over one numbering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.assembly import Cells, make_cells, mass_blocks
from fem.contact import Contact, ContactLaw, contact_pair, join
from fem.errors import FemInputError
from fem.material import Material
from fem.mesh import Mesh
from fem.pairing import surface_points
from fem.sparse_product import SparseProduct

AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Body:
    """A meshed part.

    ``kinematics`` "green_lagrange" keeps all terms; "linear" drops the quadratic strain of this body: its error is of
    the order of its strains and rotations, and it saves the element loop.
    """

    name: str
    mesh: Mesh
    material: Material
    kinematics: str = "green_lagrange"


@dataclass(frozen=True)
class Pair:
    """A frictional interface between two surfaces named "<body>.<surface>"; penalties default: ``default_penalty``."""

    name: str
    slave: str
    master: str
    friction: float
    normal_penalty: float | None = None
    tangential_penalty: float | None = None


@dataclass(frozen=True)
class Support:
    """Fixed directions ("x", "y", "z") on a surface."""

    surface: str
    directions: tuple[str, ...]


@dataclass(frozen=True)
class Clamp:
    """A dead pressure on a surface that sums to ``total_force`` N against its outward normals."""

    name: str
    surface: str
    total_force: float


@dataclass(frozen=True)
class Model:
    """The assembled structure; degree of freedom 3 node + direction.

    Attributes
    ----------
    bodies : parts; offsets : first node of each.
    points : (n_node, 3) m.
    nonlinear : cells with Green-Lagrange strain, per body; stiffness : (n_dof, n_dof) of the linear bodies, N/m.
    mass : (n_dof, n_dof) kg, consistent.
    contact : all interfaces; pairs : their definitions.
    free : (n_dof,) False where a support holds.
    load : (n_dof,) N, sum of the clamps at load factor 1; loads : (n_clamp, n_dof) each one.
    """

    bodies: tuple[Body, ...]
    offsets: IntArray
    points: FloatArray
    nonlinear: tuple[Cells, ...]
    stiffness: sp.csr_matrix
    mass: sp.csr_matrix
    contact: Contact
    pairs: tuple[Pair, ...]
    supports: tuple[Support, ...]
    clamps: tuple[Clamp, ...]
    free: BoolArray
    load: FloatArray
    loads: FloatArray

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom, supports included."""
        return len(self.free)

    def facets(self, name: str) -> IntArray:
        """Global node numbers of the facets of surface "<body>.<surface>"."""
        index, surface = _locate(self.bodies, name)
        return np.asarray(self.bodies[index].mesh.surface(surface) + self.offsets[index])

    def elastic_force(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Internal force of all bodies (n_dof, n_case) N and their strain energy (n_case,) J at u (n_dof, n_case) m."""
        force = SparseProduct(self.stiffness)(u)
        energy = 0.5 * np.einsum("nc,nc->c", u, force)
        for cells in self.nonlinear:
            f, e = cells.internal_force(u)
            force, energy = force + f, energy + e
        return force, energy

    def body_forces(self, u: FloatArray, v: FloatArray, beta: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Elastic force of all bodies, viscous force of the Green-Lagrange ones (n_dof, n_case) N, strain energy J.

        The viscous force of linear bodies is beta times their constant stiffness times v and not part of this.
        """
        elastic = SparseProduct(self.stiffness)(u)
        viscous, energy = np.zeros_like(u), 0.5 * np.einsum("nc,nc->c", u, elastic)
        for cells in self.nonlinear:
            f, g, e = cells.forces(u, v, beta)
            elastic, viscous, energy = elastic + f, viscous + g, energy + e
        return elastic, viscous, energy

    def elastic_tangent(self, u: FloatArray, *, geometric: bool = True) -> sp.csr_matrix:
        """Tangent of all bodies at u (n_dof,), N/m; without stress stiffening it is what beta multiplies in damping."""
        tangent = self.stiffness
        for cells in self.nonlinear:
            tangent = tangent + cells.assemble(cells.element_tangents(np.ascontiguousarray(u), geometric=geometric))
        return tangent.tocsr()

    def constrain(self, matrix: sp.csr_matrix) -> sp.csr_matrix:
        """Rows and columns of the supported degrees of freedom replaced by the identity."""
        keep = sp.diags(self.free.astype(float))
        return (keep @ matrix @ keep + sp.diags((~self.free).astype(float))).tocsr()

    def direction(self, axis: str) -> FloatArray:
        """b: 1 in the degrees of freedom along an axis, (n_dof,)."""
        b = np.zeros(self.n_dof)
        b[AXES[axis] :: 3] = 1.0
        return b


def build_model(
    bodies: Sequence[Body],
    *,
    pairs: Sequence[Pair] = (),
    supports: Sequence[Support] = (),
    clamps: Sequence[Clamp] = (),
) -> Model:
    """Assemble bodies, interfaces, supports and clamping pressures into a model.

    Unknown names, inverted cells and interfaces without partners raise ``FemInputError``.
    """
    bodies = tuple(bodies)
    names = [body.name for body in bodies]
    if not names or len(set(names)) < len(names):
        raise FemInputError("a model needs bodies with names of their own", where="model", value=", ".join(names))
    counts = [len(body.mesh.points) for body in bodies]
    offsets = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
    points = np.vstack([body.mesh.points for body in bodies])
    n_node = len(points)
    nonlinear, stiffness, mass = [], sp.csr_matrix((3 * n_node, 3 * n_node)), sp.csr_matrix((3 * n_node, 3 * n_node))
    for body, offset in zip(bodies, offsets, strict=True):
        lame = (body.material.lame_lambda, body.material.shear_modulus)
        cells = make_cells(body.mesh, int(offset), n_node, lame)
        mass = mass + cells.assemble(mass_blocks(body.mesh, body.material.density))
        if body.kinematics == "linear":
            stiffness = stiffness + cells.assemble(cells.element_tangents(np.zeros(3 * n_node)))
        elif body.kinematics == "green_lagrange":
            nonlinear.append(cells)
        else:
            advice = 'choose "green_lagrange" or "linear"'
            raise FemInputError("unknown kinematics", where=f"body {body.name}", value=body.kinematics, advice=advice)
    contact = join(tuple(_contact(bodies, offsets, points, pair) for pair in pairs), 3 * n_node)
    loads = np.array([_pressure(bodies, offsets, points, clamp) for clamp in clamps]).reshape(-1, 3 * n_node)
    return Model(
        bodies,
        offsets,
        points,
        tuple(nonlinear),
        stiffness.tocsr(),
        mass.tocsr(),
        contact,
        tuple(pairs),
        tuple(supports),
        tuple(clamps),
        _free(bodies, offsets, n_node, supports),
        loads.sum(axis=0),
        loads,
    )


def default_penalty(body: Body, facets: IntArray) -> float:
    """k = E / h with the mean facet size h: the interface is as stiff as a layer of one facet size, Pa/m.

    Its error is an extra compliance: penetration p / k, and elastic slip tau / k before real slip.
    """
    surface = surface_points(body.mesh.points, facets)
    return body.material.young_modulus / float(np.sqrt(surface.area.sum() / len(facets)))


def _locate(bodies: Sequence[Body], name: str) -> tuple[int, str]:
    body, _, surface = name.partition(".")
    names = [b.name for b in bodies]
    if body not in names or not surface:
        advice = f"surfaces are <body>.<surface> with the bodies {', '.join(names)}"
        raise FemInputError("unknown surface", where="model", value=name, advice=advice)
    return names.index(body), surface


def _contact(bodies: Sequence[Body], offsets: IntArray, points: FloatArray, pair: Pair) -> Contact:
    s, slave = _locate(bodies, pair.slave)
    m, master = _locate(bodies, pair.master)
    facets = bodies[s].mesh.surface(slave)
    default = default_penalty(bodies[s], facets)
    law = ContactLaw(
        default if pair.normal_penalty is None else pair.normal_penalty,
        default if pair.tangential_penalty is None else pair.tangential_penalty,
        pair.friction,
    )
    return contact_pair(pair.name, points, facets + offsets[s], bodies[m].mesh.surface(master) + offsets[m], law)


def _pressure(bodies: Sequence[Body], offsets: IntArray, points: FloatArray, clamp: Clamp) -> FloatArray:
    index, surface = _locate(bodies, clamp.surface)
    at = surface_points(points, bodies[index].mesh.surface(surface) + offsets[index])
    density = -clamp.total_force / at.area.sum() * at.area[:, None] * at.normals
    load = np.zeros((len(points), 3))
    np.add.at(load, at.nodes, at.shape[:, :, None] * density[:, None, :])
    return load.ravel()


def _free(bodies: Sequence[Body], offsets: IntArray, n_node: int, supports: Sequence[Support]) -> BoolArray:
    free = np.ones((n_node, 3), dtype=bool)
    for support in supports:
        index, surface = _locate(bodies, support.surface)
        nodes = np.unique(bodies[index].mesh.surface(surface)) + offsets[index]
        for direction in support.directions:
            if direction not in AXES:
                raise FemInputError("unknown direction", where=f"support {support.surface}", value=direction)
            free[nodes, AXES[direction]] = False
    return free.ravel()
