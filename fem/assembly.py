"""Integration data and sparse patterns of a meshed body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.body import Body
from fem.element import ReferenceElement, reference_element
from fem.errors import FemInputError
from fem.kernel import element_forces, element_tangents, gather, scatter_blocks
from fem.mesh import Mesh


@dataclass(frozen=True)
class BlockPattern:
    """Block-sparse rows: indptr (n_node + 1,), columns (n_block,), block_map (n_cell n_local^2,) into the blocks."""

    indptr: IntArray
    columns: IntArray
    block_map: IntArray


@dataclass(frozen=True)
class Cells:
    """Shape gradients, weights and gather lists of one group of cells.

    Attributes
    ----------
    gradients : (n_cell, n_point, 3, n_local) 1/m; weights : (n_cell, n_point) m^3.
    nodes : (n_cell, n_local) global node numbers; n_node : global number of nodes.
    lame : (n_cell, 2) Pa; initial_stress : (n_cell, 3, 3) Pa second Piola-Kirchhoff, or (0, 3, 3) for none.
    pointers, entries : cells around each node, see ``kernel.gather``.
    """

    gradients: FloatArray
    weights: FloatArray
    nodes: IntArray
    n_node: int
    lame: FloatArray
    initial_stress: FloatArray
    pointers: IntArray
    entries: IntArray

    def internal_force(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Internal force (n_dof, n_case) in N and strain energy (n_case,) in J at u (n_dof, n_case) in m."""
        force, _, energy = self.forces(u, u, 0.0)
        return force, energy

    def forces(self, u: FloatArray, v: FloatArray, beta: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Elastic and viscous force (n_dof, n_case) in N and strain energy (n_case,) in J.

        u, v (n_dof, n_case) m and m/s; S_v = beta C:E' in s; beta = 0 gives no viscous force.
        """
        n_cell, n_local = self.nodes.shape
        n_case = u.shape[1]
        elastic = np.empty((n_cell, n_local, 3, n_case))
        viscous = np.empty((n_cell, n_local, 3, n_case)) if beta > 0.0 else np.empty((0, 0, 3, n_case))
        energies = np.empty((n_cell, n_case))
        data = (self.gradients, self.weights, self.nodes, self.lame, self.initial_stress)
        element_forces(*data, u, v, beta, elastic, viscous, energies)
        sums = []
        for parts in (elastic, viscous):
            total = np.zeros_like(u)
            if parts.size:
                gather(self.pointers, self.entries, parts.reshape(-1, 3, n_case), total)
            sums.append(total)
        return sums[0], sums[1], energies.sum(axis=0)

    def element_tangents(self, u: FloatArray, *, geometric: bool = True) -> FloatArray:
        """Cell tangents (n_cell, n_local, n_local, 3, 3) N/m at u (n_dof,) m, without stress stiffening on request."""
        n_cell, n_local = self.nodes.shape
        tangents = np.empty((n_cell, n_local, n_local, 3, 3))
        data = (self.gradients, self.weights, self.nodes, self.lame, self.initial_stress)
        element_tangents(*data, u, float(geometric), tangents)
        return tangents

    def assemble(self, blocks: FloatArray) -> sp.csr_matrix:
        """Sparse matrix (n_dof, n_dof) from cell blocks (n_cell, n_local, n_local, 3, 3)."""
        pattern = self.pattern
        data = np.zeros((len(pattern.columns), 3, 3))
        scatter_blocks(pattern.block_map, np.ascontiguousarray(blocks.reshape(-1, 3, 3)), data)
        shape = (3 * self.n_node, 3 * self.n_node)
        return sp.bsr_matrix((data, pattern.columns, pattern.indptr), shape=shape).tocsr()

    @cached_property
    def pattern(self) -> BlockPattern:
        """Where every cell block goes in the block-sparse matrix."""
        n_local = self.nodes.shape[1]
        rows = np.repeat(self.nodes, n_local, axis=1).ravel()
        columns = np.tile(self.nodes, (1, n_local)).ravel()
        keys, block_map = np.unique(rows * self.n_node + columns, return_inverse=True)
        indptr = np.searchsorted(keys // self.n_node, np.arange(self.n_node + 1))
        return BlockPattern(indptr.astype(np.int64), keys % self.n_node, block_map.ravel())


def physical_gradients(
    reference: ReferenceElement, rule: tuple[FloatArray, FloatArray], points: FloatArray, cells: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Gradients (n_cell, n_point, 3, n_local) in 1/m and weights w det J (n_cell, n_point) in m^3.

    A cell with det J <= 0 at an integration point raises ``FemInputError`` that names it.
    """
    x, w = rule
    _, dn = reference.shape(x)
    jacobian = np.einsum("eai,qaj->eqij", points[cells], dn, optimize=True)
    det = np.linalg.det(jacobian)
    if np.any(det <= 0.0):
        bad = int(np.argmin(det.min(axis=1)))
        raise FemInputError(
            "inverted cell: det J <= 0",
            where=f"cell {bad} at {points[cells[bad]].mean(axis=0)}",
            value=float(det[bad].min()),
            advice="check the node order and the shape of this cell",
        )
    gradients = np.einsum("qaj,eqji->eqia", dn, np.linalg.inv(jacobian), optimize=True)
    return np.ascontiguousarray(gradients), det * w


def make_cells(body: Body, offset: int, n_node: int) -> Cells:
    """Integration data of a body whose nodes start at ``offset`` in a model of ``n_node`` nodes."""
    mesh, lame = body.mesh, (body.material.lame_lambda, body.material.shear_modulus)
    reference = reference_element(mesh.element)
    gradients, weights = physical_gradients(reference, reference.stiffness_rule(), mesh.points, mesh.cells)
    nodes = np.ascontiguousarray(mesh.cells + offset)
    order = np.argsort(nodes.ravel(), kind="stable")
    pointers = np.searchsorted(nodes.ravel()[order], np.arange(n_node + 1))
    table = np.tile(np.array(lame), (len(nodes), 1))
    pointers, order = pointers.astype(np.int64), order.astype(np.int64)
    return Cells(gradients, weights, nodes, n_node, table, body.cell_stress(), pointers, order)


def mass_blocks(mesh: Mesh, density: float) -> FloatArray:
    """Consistent mass of every cell as blocks (n_cell, n_local, n_local, 3, 3) in kg: m_ab = sum_q w rho N_a N_b I."""
    reference = reference_element(mesh.element)
    x, w = reference.mass_rule()
    n, _ = reference.shape(x)
    _, weights = physical_gradients(reference, (x, w), mesh.points, mesh.cells)
    scalar = density * np.einsum("eq,qa,qb->eab", weights, n, n, optimize=True)
    return np.asarray(scalar[..., None, None] * np.eye(3))


def lumped_masses(mesh: Mesh, density: float) -> FloatArray:
    """Nodal masses of every cell (n_cell, n_local) in kg: the diagonal of the consistent mass scaled to the cell mass.

    All are positive, unlike row sums of quadratic elements.

    Source: Hinton, Rock & Zienkiewicz, Earthquake Eng. Struct. Dyn. 4 (1976) 245-249.
    """
    reference = reference_element(mesh.element)
    x, w = reference.mass_rule()
    n, _ = reference.shape(x)
    _, weights = physical_gradients(reference, (x, w), mesh.points, mesh.cells)
    diagonal = weights @ n**2
    return np.asarray(density * diagonal * (weights.sum(axis=1) / diagonal.sum(axis=1))[:, None])
