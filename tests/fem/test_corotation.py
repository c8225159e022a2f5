"""Nodal rotations and the factor they carry along."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from fem.corotation import NodalRotation, rotate
from fem.model import Body, build_model
from tests.fem.small_models import STEEL, box, distorted, single


def test_rotate_is_rodrigues_and_orthogonal() -> None:
    rng = np.random.default_rng(1)
    w = rng.standard_normal((5, 3, 4)) * np.array([1e-9, 1e-4, 2e-3, 1.0])
    x = rng.standard_normal((5, 3, 4))
    flat = w.reshape(15, 4), x.reshape(15, 4)
    turned = rotate(flat[0], 1.0, flat[1])
    for node in range(5):
        for case in range(4):
            expected = Rotation.from_rotvec(w[node, :, case]).apply(x[node, :, case])
            np.testing.assert_allclose(turned[3 * node : 3 * node + 3, case], expected, atol=1e-14)
    np.testing.assert_allclose(rotate(flat[0], -1.0, turned), flat[1], atol=1e-14)


def test_half_curl_of_a_rigid_rotation_is_its_sine() -> None:
    """u = (R - I) x has curl(u)/2 = sin(angle) n at every node, on distorted cells too."""
    model = single(distorted(box((1.0, 0.8, 0.6), (2, 1, 1)), 0.05))
    axis, angle = np.array([0.6, 0.0, 0.8]), 0.3
    R = Rotation.from_rotvec(angle * axis).as_matrix()
    u = (model.points @ (R - np.eye(3)).T).ravel()
    w = NodalRotation(model)(u[:, None]).reshape(-1, 3)
    np.testing.assert_allclose(w, np.tile(np.sin(angle) * axis, (len(w), 1)), atol=1e-13)


def test_tangent_of_a_rotated_body_is_the_rotated_tangent() -> None:
    """K(R x - x) = R K(0) R': what the preconditioner relies on, exact for a rigid rotation."""
    model = single(distorted(box((1.0, 0.8, 0.6), (2, 1, 1)), 0.05))
    w = np.tile(0.4 * np.array([0.0, 0.6, 0.8]), len(model.points))[:, None]
    u = rotate(w, 1.0, model.points.reshape(-1, 1).copy()) - model.points.reshape(-1, 1)
    d = np.random.default_rng(2).standard_normal((model.n_dof, 1))
    K = model.elastic_tangent(np.zeros(model.n_dof))
    expected = rotate(w, 1.0, K @ rotate(w, -1.0, d))
    np.testing.assert_allclose(model.elastic_tangent(u[:, 0]) @ d, expected, atol=1e-12 * np.abs(expected).max())


def test_linear_bodies_do_not_turn() -> None:
    bodies = [
        Body("soft", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL),
        Body("stiff", box((1.0, 1.0, 1.0), (1, 1, 1), shift=1.0), STEEL, "linear"),
    ]
    model = build_model(bodies)
    u = np.random.default_rng(3).standard_normal((model.n_dof, 1))
    w = NodalRotation(model)(u)
    start = 3 * int(model.offsets[1])
    np.testing.assert_array_equal(w[start:], 0.0)
    assert np.abs(w[:start]).min() > 0.0
