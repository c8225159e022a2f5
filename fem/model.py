"""A structure ready to compute: bodies, interfaces, supports and loads assembled over one numbering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.assembly import Cells, lumped_masses, make_cells, mass_blocks
from fem.body import Body, locate
from fem.bolt import Bolt, BoltSet, bolt_set, cut_bolts
from fem.contact import Contact, join
from fem.errors import FemInputError
from fem.follower import FollowerSet, follower_set
from fem.interfaces import Pair, Tie, bond_stiffness, default_penalty, pair_contact, tie_bond
from fem.loads import (
    Assembly,
    Clamp,
    FollowerPressure,
    Force,
    Gravity,
    Load,
    PointForce,
    Pressure,
    Traction,
    load_vector,
)
from fem.names import unlike
from fem.sparse_product import SparseProduct
from fem.springs import (
    Elastic,
    Foundation,
    PointMass,
    Spring,
    SpringSet,
    lumped_point_masses,
    point_mass_matrix,
    spring_set,
)
from fem.supports import AXES, Support, held

__all__ = [
    "AXES",
    "Body",
    "Bolt",
    "Clamp",
    "FollowerPressure",
    "Force",
    "Foundation",
    "Gravity",
    "Model",
    "Pair",
    "PointForce",
    "PointMass",
    "Pressure",
    "Spring",
    "Support",
    "Tie",
    "Traction",
    "build_model",
    "default_penalty",
]


@dataclass(frozen=True)
class Model:
    """The assembled structure; degree of freedom 3 node + direction.

    Attributes
    ----------
    bodies : parts; offsets : first node of each.
    points : (n_node, 3) m.
    nonlinear : cells with Green-Lagrange strain, per body; stiffness : (n_dof, n_dof) of linear bodies and ties, N/m.
    mass : (n_dof, n_dof) kg, consistent.
    contact : all interfaces; pairs : their definitions.
    free : (n_dof,) False where a support holds; prescribed : (n_dof,) m, displacement there at load factor 1.
    load : (n_dof,) N, sum of clamps and other loads at load factor 1; loads : (n_load, n_dof) each one, clamps first.
    ties, bonds : bonded surfaces, then the sections of bolts, and their points; bolts : see ``BoltSet``.
    springs : springs and foundations, part of ``stiffness``; point_masses : part of ``mass``.
    followers : pressures that turn with their surfaces; they count among the internal forces, not in ``load``.
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
    prescribed: FloatArray
    ties: tuple[Tie, ...]
    bonds: Contact
    bolts: BoltSet
    springs: SpringSet
    point_masses: tuple[PointMass, ...]
    followers: FollowerSet

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom, supports included."""
        return len(self.free)

    def following(self, share: float) -> Model:
        """The model with a share of its follower pressures acting, 1 for all of each."""
        return self if share == self.followers.factor else replace(self, followers=self.followers.scaled(share))

    def facets(self, name: str) -> IntArray:
        """Global node numbers of the facets of surface "<body>.<surface>"."""
        index, surface = locate(self.bodies, name, where="facets", surface=True)
        return np.asarray(self.bodies[index].mesh.surface(surface) + self.offsets[index])

    def elastic_force(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Internal force of all bodies (n_dof, n_case) N and their strain energy (n_case,) J at u (n_dof, n_case) m.

        Follower pressures are taken off the force.
        """
        force = SparseProduct(self.stiffness)(u)
        energy = 0.5 * np.einsum("nc,nc->c", u, force)
        for cells in self.nonlinear:
            f, e = cells.internal_force(u)
            force, energy = force + f, energy + e
        if self.followers.any:
            force = force - self.followers.force(u)
        return force, energy

    def body_forces(self, u: FloatArray, v: FloatArray, beta: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Elastic force of all bodies, viscous force of the Green-Lagrange ones (n_dof, n_case) N, strain energy J.

        The viscous force of linear bodies is beta times their constant stiffness times v and not part of this.
        """
        linear = SparseProduct(self.stiffness)(u)
        elastic, viscous, energy = self.cell_forces(u, v, beta)
        return elastic + linear, viscous, energy + 0.5 * np.einsum("nc,nc->c", u, linear)

    def cell_forces(self, u: FloatArray, v: FloatArray, beta: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The part of ``body_forces`` that belongs to the Green-Lagrange bodies, less follower pressures."""
        if not self.nonlinear:
            elastic, viscous, energy = np.zeros_like(u), np.zeros_like(u), np.zeros(u.shape[1])
        else:
            elastic, viscous, energy = self.nonlinear[0].forces(u, v, beta)
        for cells in self.nonlinear[1:]:
            f, g, e = cells.forces(u, v, beta)
            elastic, viscous, energy = elastic + f, viscous + g, energy + e
        if self.followers.any:
            elastic = elastic - self.followers.force(u)
        return elastic, viscous, energy

    def elastic_tangent(self, u: FloatArray, *, geometric: bool = True) -> sp.csr_matrix:
        """Tangent of all bodies at u (n_dof,), N/m; without stress stiffening it is what beta multiplies in damping.

        With stress stiffening it holds the load stiffness of follower pressures, unsymmetric where they have no
        potential.
        """
        tangent = self.stiffness
        for cells in self.nonlinear:
            tangent = tangent + cells.assemble(cells.element_tangents(np.ascontiguousarray(u), geometric=geometric))
        if geometric and self.followers.any:
            tangent = tangent - self.followers.stiffness(u)
        return tangent.tocsr()

    def constrain(self, matrix: sp.csr_matrix) -> sp.csr_matrix:
        """Rows and columns of the supported degrees of freedom replaced by the identity."""
        keep = sp.diags(self.free.astype(float))
        return (keep @ matrix @ keep + sp.diags((~self.free).astype(float))).tocsr()

    def lumped_mass(self) -> FloatArray:
        """Diagonal mass (n_dof,) in kg by the scheme of Hinton, Rock and Zienkiewicz, see ``lumped_masses``."""
        mass = lumped_point_masses(self.point_masses, Assembly(self.bodies, self.offsets, self.points, self.mass))
        for body, offset in zip(self.bodies, self.offsets, strict=True):
            np.add.at(mass, body.mesh.cells + offset, lumped_masses(body.mesh, body.material.density))
        return np.repeat(mass, 3)

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
    loads: Sequence[Load] = (),
    ties: Sequence[Tie] = (),
    bolts: Sequence[Bolt] = (),
    springs: Sequence[Elastic] = (),
    point_masses: Sequence[PointMass] = (),
) -> Model:
    """Assemble bodies, interfaces, ties, bolts, supports, springs, masses and dead loads into a model.

    Unknown names, inverted cells, interfaces without partners and numbers that are not finite raise ``FemInputError``.
    """
    _check_names(bodies)
    unlike([*(p.name for p in pairs), *(t.name for t in ties), *(b.name for b in bolts)], "joints")
    bodies, sections = cut_bolts(bodies, bolts)
    offsets = np.concatenate([[0], np.cumsum([len(body.mesh.points) for body in bodies])[:-1]]).astype(np.int64)
    points = np.vstack([body.mesh.points for body in bodies])
    n_node = len(points)
    nonlinear, stiffness, mass = _matrices(bodies, offsets, n_node)
    contact = join(tuple(pair_contact(bodies, offsets, points, pair) for pair in pairs), 3 * n_node)
    all_ties = (*ties, *sections)
    bonds = tuple(tie_bond(bodies, offsets, points, tie) for tie in all_ties)
    stiffness = sum((bond_stiffness(bond) for bond in bonds), stiffness)
    assembly = Assembly(bodies, offsets, points, mass)
    elastic = spring_set(springs, assembly)
    mass = mass + point_mass_matrix(point_masses, assembly)
    assembly = replace(assembly, mass=mass)
    dead = (*clamps, *(load for load in loads if not isinstance(load, FollowerPressure)))
    vectors = np.array([load_vector(load, assembly) for load in dead]).reshape(-1, 3 * n_node)
    free, prescribed = held(bodies, offsets, n_node, supports)
    return Model(
        bodies,
        offsets,
        points,
        nonlinear,
        (stiffness + elastic.matrix).tocsr(),
        mass.tocsr(),
        contact,
        tuple(pairs),
        tuple(supports),
        tuple(clamps),
        free,
        vectors.sum(axis=0),
        vectors,
        prescribed,
        all_ties,
        join(bonds, 3 * n_node),
        bolt_set(bolts, bonds[len(bonds) - len(sections) :], 3 * n_node),
        elastic,
        tuple(point_masses),
        follower_set(loads, bodies, offsets, points),
    )


def _matrices(
    bodies: Sequence[Body], offsets: IntArray, n_node: int
) -> tuple[tuple[Cells, ...], sp.csr_matrix, sp.csr_matrix]:
    """Cells of the Green-Lagrange bodies, stiffness of the linear ones, mass of all."""
    nonlinear, stiffness, mass = [], sp.csr_matrix((3 * n_node, 3 * n_node)), sp.csr_matrix((3 * n_node, 3 * n_node))
    for body, offset in zip(bodies, offsets, strict=True):
        cells = make_cells(body, int(offset), n_node)
        mass = mass + cells.assemble(mass_blocks(body.mesh, body.material.density))
        if body.kinematics == "linear":
            stiffness = stiffness + cells.assemble(cells.element_tangents(np.zeros(3 * n_node)))
        else:
            nonlinear.append(cells)
    return tuple(nonlinear), stiffness, mass


def _check_names(bodies: Sequence[Body]) -> None:
    names = [body.name for body in bodies]
    if not names or len(set(names)) < len(names):
        raise FemInputError("a model needs bodies with names of their own", where="model", value=", ".join(names))
