"""Stresses at integration points and nodes: second Piola-Kirchhoff, Cauchy, von Mises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.assembly import physical_gradients
from fem.body import Body
from fem.element import ReferenceElement, reference_element
from fem.errors import FemInputError
from fem.finite_values import finite_array
from fem.loads import Vector
from fem.locate_point import cell_of_point
from fem.model import Model
from fem.names import nearest


@dataclass(frozen=True)
class Stress:
    """Stress tensors at points, Pa.

    Attributes
    ----------
    points : (n_point, 3) m, undeformed.
    second_piola : (n_point, 3, 3) S = S_0 + lambda tr(E) I + 2 mu E.
    cauchy : (n_point, 3, 3) F S F'/det F; equal to S in bodies with linear kinematics.
    """

    points: FloatArray
    second_piola: FloatArray
    cauchy: FloatArray

    @property
    def von_mises(self) -> FloatArray:
        """sqrt(3/2 s:s) with the deviator s of the Cauchy stress, (n_point,) Pa."""
        mean = np.trace(self.cauchy, axis1=1, axis2=2)[:, None, None] / 3.0
        deviator = self.cauchy - mean * np.eye(3)
        return np.asarray(np.sqrt(1.5 * np.einsum("pij,pij->p", deviator, deviator)))


def integration_point_stress(model: Model, u: FloatArray, body: str) -> Stress:
    """Stress at the integration points of the stiffness of one body, n_point = n_cell n_rule, cell by cell.

    u (n_dof,) m.
    """
    names = [b.name for b in model.bodies]
    if body not in names:
        raise FemInputError("unknown body", where="stress", value=body, advice=nearest(body, names, "bodies are"))
    index = names.index(body)
    return _at_points(model.bodies[index], _displacement(model, u, index))


def nodal_stress(model: Model, u: FloatArray) -> Stress:
    """Stress at all nodes of the model: extrapolated in every cell, averaged over the cells of the body at a node.

    The extrapolation is the least-squares polynomial through the integration points, linear in TET10, trilinear in
    HEX20 (their stresses are most accurate there), triquadratic in HEX27. Bodies are not averaged with each other.

    Source: Hinton & Campbell, Int. J. Numer. Methods Eng. 8 (1974) 461-480.
    """
    parts = []
    for index, body in enumerate(model.bodies):
        at = _at_points(body, _displacement(model, u, index))
        parts.append([_averaged(body, tensor) for tensor in (at.second_piola, at.cauchy)])
    return Stress(model.points, *(np.concatenate(tensors) for tensors in zip(*parts, strict=True)))


def point_stress(model: Model, u: FloatArray, points: Sequence[Vector], *, body: str | None = None) -> Stress:
    """Nodal stress interpolated at material points (n_point, 3) m, by the shape functions of the cell around each.

    ``body`` names the one to look at where bodies touch. A point outside all bodies, or on several without it, raises
    ``FemInputError``.
    """
    advice = "give (n_point, 3) numbers, one point as [(x, y, z)]"
    places = finite_array(points, (-1, 3), "the table of points", where="stress", advice=advice)
    nodal = nodal_stress(model, u)
    tensors = np.empty((2, len(places), 3, 3))
    for number, point in enumerate(places):
        found = cell_of_point(model.bodies, model.offsets, point, where=f"stress at point {number}", body=body)
        for kind, tensor in enumerate((nodal.second_piola, nodal.cauchy)):
            tensors[kind, number] = np.einsum("a,aij->ij", found.shape, tensor[found.nodes])
    return Stress(places, tensors[0], tensors[1])


def _displacement(model: Model, u: FloatArray, index: int) -> FloatArray:
    u = finite_array(u, (model.n_dof,), "the displacement", where="stress")
    start = int(model.offsets[index])
    return u.reshape(-1, 3)[start : start + len(model.bodies[index].mesh.points)]


def _at_points(body: Body, u: FloatArray) -> Stress:
    mesh = body.mesh
    reference = reference_element(mesh.element)
    rule = reference.stiffness_rule()
    gradients, _ = physical_gradients(reference, rule, mesh.points, mesh.cells)
    grad_u = np.einsum("eai,eqja->eqij", u[mesh.cells], gradients, optimize=True)
    strain = 0.5 * (grad_u + np.swapaxes(grad_u, 2, 3))
    F = np.broadcast_to(np.eye(3), grad_u.shape)
    if body.kinematics == "green_lagrange":
        strain = strain + 0.5 * np.einsum("eqki,eqkj->eqij", grad_u, grad_u)
        F = np.eye(3) + grad_u
    trace = np.trace(strain, axis1=2, axis2=3)[..., None, None]
    S = body.material.lame_lambda * trace * np.eye(3) + 2.0 * body.material.shear_modulus * strain
    if body.initial_stress is not None:
        S = S + body.cell_stress()[:, None]
    cauchy = F @ S @ np.swapaxes(F, 2, 3) / np.linalg.det(F)[..., None, None]
    places = np.einsum("qa,eai->eqi", reference.shape(rule[0])[0], mesh.points[mesh.cells])
    return Stress(places.reshape(-1, 3), S.reshape(-1, 3, 3), cauchy.reshape(-1, 3, 3))


def _averaged(body: Body, tensor: FloatArray) -> FloatArray:
    """Nodal means (n_node, 3, 3) of the extrapolated values of all cells around a node."""
    mesh = body.mesh
    reference = reference_element(mesh.element)
    at_nodes = _extrapolation(reference)
    values = np.einsum("aq,eqij->eaij", at_nodes, tensor.reshape(len(mesh.cells), -1, 3, 3))
    total, count = np.zeros((len(mesh.points), 3, 3)), np.zeros(len(mesh.points))
    np.add.at(total, mesh.cells, values)
    np.add.at(count, mesh.cells, 1.0)
    return np.asarray(total / np.maximum(count, 1.0)[:, None, None])


def _extrapolation(reference: ReferenceElement) -> FloatArray:
    """Matrix (n_local, n_rule) from values at the integration points to values at the nodes."""
    points = reference.stiffness_rule()[0]
    return np.asarray(_basis(reference.name, reference.nodes) @ np.linalg.pinv(_basis(reference.name, points)))


def _basis(name: str, x: FloatArray) -> FloatArray:
    """Monomials (n_point, n_term): linear, trilinear or triquadratic."""
    if name == "tet10":
        return np.column_stack([np.ones(len(x)), x])
    highest = 2 if name == "hex27" else 1
    powers = np.stack(np.meshgrid(*(np.arange(highest + 1),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(np.prod(x[:, None, :] ** powers[None], axis=2))
