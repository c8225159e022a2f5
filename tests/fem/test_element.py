"""Reference elements: partition of unity, gradients, quadrature, faces."""

from __future__ import annotations

from itertools import product
from math import factorial

import numpy as np
import pytest

from fem.element import reference_element
from fem.errors import FemInputError

ALL = ("hex20", "hex27", "tet10", "quad8", "quad9", "tri6")
SOLID = ("hex20", "hex27", "tet10")


def _inside(name: str, count: int = 7) -> np.ndarray:
    dim = reference_element(name).nodes.shape[1]
    x = np.random.default_rng(3).uniform(0.0, 1.0, (count, dim))
    return np.asarray(x / (1.0 + x.sum(axis=1, keepdims=True)) if name in {"tet10", "tri6"} else x)


@pytest.mark.parametrize("name", ALL)
def test_shape_functions_are_one_at_their_node_and_sum_to_one(name: str) -> None:
    element = reference_element(name)
    at_nodes, _ = element.shape(element.nodes)
    np.testing.assert_allclose(at_nodes, np.eye(len(element.nodes)), atol=1e-14)
    n, dn = element.shape(_inside(name))
    np.testing.assert_allclose(n.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(dn.sum(axis=1), 0.0, atol=1e-13)


@pytest.mark.parametrize("name", ALL)
def test_quadratic_fields_are_interpolated_exactly(name: str) -> None:
    element, x = reference_element(name), _inside(name)

    def field(p: np.ndarray) -> np.ndarray:
        value = 1.0 + p[:, 0] - 2.0 * p[:, 1] + 3.0 * p[:, 0] * p[:, 1] + p[:, 0] ** 2 - 0.5 * p[:, -1] ** 2
        return np.asarray(value)

    n, _ = element.shape(x)
    np.testing.assert_allclose(n @ field(element.nodes), field(x), atol=1e-14)


@pytest.mark.parametrize("name", ALL)
def test_gradients_equal_central_differences(name: str) -> None:
    element, x, h = reference_element(name), _inside(name), 1e-5
    _, dn = element.shape(x)
    for d in range(x.shape[1]):
        step = h * np.eye(x.shape[1])[d]
        difference = (element.shape(x + step)[0] - element.shape(x - step)[0]) / (2.0 * h)
        # Third derivatives below 20: truncation 20 h^2/6 = 3e-10; roundoff 1e-16/h = 1e-11.
        np.testing.assert_allclose(dn[:, :, d], difference, atol=1e-9)


def _exact(powers: tuple[int, ...], simplex: bool) -> float:
    if simplex:
        return float(np.prod([factorial(p) for p in powers])) / factorial(sum(powers) + len(powers))
    return float(np.prod([1.0 / (p + 1) for p in powers]))


@pytest.mark.parametrize(
    ("name", "rule", "degree"),
    [
        ("tet10", "stiffness", 2),
        ("hex20", "stiffness", 5),
        ("hex27", "stiffness", 5),
        ("tet10", "mass", 4),
        ("hex20", "mass", 5),
        ("tri6", "mass", 4),
        ("quad8", "mass", 5),
        ("quad9", "mass", 5),
    ],
)
def test_quadrature_is_exact_up_to_its_degree(name: str, rule: str, degree: int) -> None:
    element = reference_element(name)
    x, w = element.stiffness_rule() if rule == "stiffness" else element.mass_rule()
    for powers in product(range(degree + 1), repeat=x.shape[1]):
        if sum(powers) <= degree:
            value = w @ np.prod(x ** np.array(powers), axis=1)
            assert value == pytest.approx(_exact(powers, name in {"tet10", "tri6"}), abs=1e-13), powers
    # The degree-4 rule of tetrahedra has a negative weight; contact points and stresses need positive ones.
    assert np.all(w > 0.0) or (name, rule) == ("tet10", "mass")


def test_irons_rule_has_fourteen_points() -> None:
    x, w = reference_element("hex20").stiffness_rule()
    assert x.shape == (14, 3)
    assert w.sum() == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("name", SOLID)
def test_faces_point_outward_and_close_the_volume(name: str) -> None:
    """Sum over the faces of int x . n dA = 3 V by the divergence theorem."""
    element = reference_element(name)
    face = reference_element(element.face_name)
    x, w = face.mass_rule()
    n, dn = face.shape(x)
    flux = 0.0
    for row in element.faces:
        corner = element.nodes[row]
        tangent = np.einsum("qad,ai->dqi", dn, corner)
        normal = np.cross(tangent[0], tangent[1])
        assert np.all(normal @ (corner.mean(axis=0) - element.nodes.mean(axis=0)) > 0.0)
        flux += w @ np.einsum("qi,qi->q", n @ corner, normal)
    assert flux == pytest.approx(3.0 * _exact((0, 0, 0), name == "tet10"), abs=1e-14)


def test_unknown_element_is_named() -> None:
    with pytest.raises(FemInputError, match="hex8"):
        reference_element("hex8")
