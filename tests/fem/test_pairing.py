"""Projection of points on curved, non-matching quadratic surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from fem.block import graded, hex_block
from fem.mesh import Mesh
from fem.pairing import face_element, project, surface_points
from tests.fem.small_models import box


def _bulge(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    return np.column_stack([x, y * (1.0 + 0.2 * np.sin(2.0 * x) - 0.1 * z * z), z])


def _curved(element: str, cells: int) -> Mesh:
    line = graded([0.0, 1.0], [cells])
    mesh = hex_block(line, graded([0.0, 1.0], [1]), line, element=element)
    return Mesh(_bulge(mesh.points), mesh.cells, mesh.element, mesh.surfaces)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_points_lifted_off_a_curved_surface_project_back(element: str) -> None:
    mesh = _curved(element, 3)
    facets = mesh.surface("y_max")
    at = surface_points(mesh.points, facets)
    found = project(mesh.points, at.points + 0.01 * at.normals, facets, 0.02)
    assert found.found.all()
    # 12 Gauss-Newton steps at the rate (distance * curvature) = 0.01: roundoff of unit lengths.
    np.testing.assert_allclose(found.points, at.points, atol=1e-12)
    np.testing.assert_allclose(found.normals, at.normals, atol=1e-10)


def test_projection_is_perpendicular_to_the_surface() -> None:
    coarse, fine = _curved("hex20", 2), _curved("hex27", 5)
    at = surface_points(fine.points, fine.surface("y_max"))
    found = project(coarse.points, at.points, coarse.surface("y_max"), 0.1)
    assert found.found.all()
    offset = at.points - found.points
    assert np.linalg.norm(offset, axis=1).max() > 1e-5
    sideways = offset - np.einsum("gi,gi->g", offset, found.normals)[:, None] * found.normals
    assert np.linalg.norm(sideways, axis=1).max() < 1e-12


def test_points_beyond_reach_or_edge_find_nothing() -> None:
    mesh = box((1.0, 1.0, 1.0), (2, 1, 2))
    targets = np.array([[0.5, 1.05, 0.5], [0.5, 1.2, 0.5], [1.05, 1.0, 0.5], [1.0, 1.0, 1.0]])
    found = project(mesh.points, targets, mesh.surface("y_max"), 0.1).found
    np.testing.assert_array_equal(found, [True, False, False, True])


def test_long_facet_beside_many_short_ones_is_found() -> None:
    """The facet under a point need not be among those with the nearest centres."""
    mesh = hex_block(graded([0.0, 1.0, 1.1], [1, 20]), graded([0.0, 0.1], [1]), graded([0.0, 0.1], [1]))
    targets = np.column_stack([np.linspace(0.0, 1.1, 45), np.full(45, 0.1), np.full(45, 0.05)])
    found = project(mesh.points, targets, mesh.surface("y_max"), 0.01)
    assert found.found.all()
    np.testing.assert_allclose(found.points, targets, atol=1e-13)


def test_surface_points_integrate_area() -> None:
    mesh = _curved("tet10", 2)
    assert face_element(mesh.surface("y_max")).name == "tri6"
    flat = surface_points(mesh.points, mesh.surface("y_min"))
    assert flat.area.sum() == pytest.approx(1.0, rel=1e-13)
    np.testing.assert_allclose(np.einsum("ga,gai->gi", flat.shape, mesh.points[flat.nodes]), flat.points, atol=1e-15)
