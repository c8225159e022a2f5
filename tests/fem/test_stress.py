"""Stress recovery: exact for the fields that the extrapolation spans; Cauchy against closed forms; kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fem.material import Material
from fem.model import Body, build_model
from fem.stress import integration_point_stress, nodal_stress
from tests.fem.small_models import STEEL, box, distorted, single

ELEMENTS = ("hex20", "hex27", "tet10")


@pytest.mark.parametrize("element", ELEMENTS)
def test_bending_stress_is_linear_and_exact_at_nodes(element: str) -> None:
    """Pure bending, nu = 0: u = k (x y, -x^2/2, 0), sigma_xx = E k y; quadratic displacement, linear stress."""
    mesh = box((1.0, 0.4, 0.3), (3, 2, 1), element)
    model = build_model([Body("body", mesh, Material(1e6, 0.0, 1.0), "linear")])
    x, y, _ = mesh.points.T
    u = 1e-3 * np.column_stack([x * y, -0.5 * x**2, 0.0 * x]).ravel()
    for stress, points in ((nodal_stress(model, u), mesh.points), (integration_point_stress(model, u, "body"), None)):
        height = stress.points[:, 1] if points is None else points[:, 1]
        expected = np.zeros((len(height), 3, 3))
        expected[:, 0, 0] = 1e3 * height
        np.testing.assert_allclose(stress.cauchy, expected, atol=1e-9)
        np.testing.assert_allclose(stress.von_mises, np.abs(1e3 * height), atol=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
def test_cauchy_stress_of_a_stretched_and_turned_body(element: str) -> None:
    """F = R diag(1.1, 1, 1), nu = 0: S_xx = E (1.1^2 - 1)/2, Cauchy = 1.1 S_xx along R e_x; on a distorted mesh."""
    mesh = distorted(box((1.0, 0.8, 0.6), (2, 1, 1), element), 0.05)
    model = single(mesh, Material(1e6, 0.0, 1.0))
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    u = (mesh.points @ (turn @ np.diag([1.1, 1.0, 1.0]) - np.eye(3)).T).ravel()
    stress = nodal_stress(model, u)
    S, axis = 1e6 * 0.105, turn[:, 0]
    np.testing.assert_allclose(stress.second_piola, np.tile(np.diag([S, 0, 0]), (len(mesh.points), 1, 1)), atol=1e-7)
    np.testing.assert_allclose(
        stress.cauchy, np.tile(1.1 * S * np.outer(axis, axis), (len(mesh.points), 1, 1)), atol=1e-7
    )
    np.testing.assert_allclose(stress.von_mises, 1.1 * S, rtol=1e-12)


def test_virtual_work_of_the_stress_is_the_internal_force() -> None:
    """f . v = int F S : grad v dV: the recovered stress is that of the kernel, initial stress included."""
    base = single(distorted(box((1.0, 0.8, 0.6), (2, 1, 1)), 0.05)).bodies[0]
    model = build_model([replace(base, initial_stress=np.diag([3e9, -1e9, 2e9]))])
    rng = np.random.default_rng(2)
    u, v = 0.05 * rng.standard_normal((2, model.n_dof))
    cells = model.nonlinear[0]
    grad_u, grad_v = (
        np.einsum("eai,eqja->eqij", field.reshape(-1, 3)[cells.nodes], cells.gradients) for field in (u, v)
    )
    S = integration_point_stress(model, u, "body").second_piola.reshape(grad_u.shape)
    work = np.einsum("eq,eqij,eqij->", cells.weights, (np.eye(3) + grad_u) @ S, grad_v)
    assert work == pytest.approx(float(model.elastic_force(u[:, None])[0][:, 0] @ v), rel=1e-11)


def test_bodies_are_not_averaged_with_each_other() -> None:
    """The same strain in steel and in a material of half the stiffness: half the stress, right up to the face."""
    soft = Material(STEEL.young_modulus / 2.0, STEEL.poisson_ratio, 1.0)
    bodies = [
        Body("lower", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL),
        Body("upper", box((1.0, 1.0, 1.0), (1, 1, 1), shift=1.0), soft),
    ]
    model = build_model(bodies)
    u = np.outer(model.points[:, 1], [0.0, 1e-6, 0.0]).ravel()
    stress = nodal_stress(model, u).cauchy[:, 1, 1]
    np.testing.assert_allclose(stress[:20], 2.0 * stress[20], rtol=1e-9)
