"""Structured blocks and meshes: volumes, surfaces, arch, refused input."""

from __future__ import annotations

import numpy as np
import pytest

from fem.assembly import physical_gradients
from fem.block import arch, graded, hex_block
from fem.element import reference_element
from fem.errors import FemInputError
from fem.mesh import Mesh
from fem.pairing import surface_points
from tests.fem.small_models import box, distorted, single

SIZE, CELLS = (0.3, 0.2, 0.1), (3, 2, 1)
ELEMENTS = ("hex20", "hex27", "tet10")


def _volume(mesh: Mesh) -> float:
    reference = reference_element(mesh.element)
    _, weights = physical_gradients(reference, reference.mass_rule(), mesh.points, mesh.cells)
    return float(weights.sum())


@pytest.mark.parametrize("element", ELEMENTS)
def test_block_fills_its_box(element: str) -> None:
    mesh = box(SIZE, CELLS, element)
    assert _volume(mesh) == pytest.approx(0.006, rel=1e-13)
    assert len(np.unique(mesh.points.round(12), axis=0)) == len(mesh.points)
    np.testing.assert_array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))


def test_hex20_and_hex27_have_the_textbook_node_counts() -> None:
    nx, ny, nz = CELLS
    edges = nx * (ny + 1) * (nz + 1) + (nx + 1) * ny * (nz + 1) + (nx + 1) * (ny + 1) * nz
    assert len(box(SIZE, CELLS).points) == (nx + 1) * (ny + 1) * (nz + 1) + edges
    assert len(box(SIZE, CELLS, "hex27").points) == (2 * nx + 1) * (2 * ny + 1) * (2 * nz + 1)


@pytest.mark.parametrize("element", ELEMENTS)
def test_named_surfaces_have_their_area_and_outward_normal(element: str) -> None:
    mesh = box(SIZE, CELLS, element)
    area = {"x": 0.02, "y": 0.03, "z": 0.06}
    for name in mesh.surfaces:
        at = surface_points(mesh.points, mesh.surface(name))
        outward = np.eye(3)["xyz".index(name[0])] * (1.0 if name.endswith("max") else -1.0)
        assert at.area.sum() == pytest.approx(area[name[0]], rel=1e-13)
        np.testing.assert_allclose(at.normals, np.tile(outward, (len(at.normals), 1)), atol=1e-13)


@pytest.mark.parametrize("element", ELEMENTS)
def test_skin_encloses_a_distorted_volume(element: str) -> None:
    """int x . n dA over the skin = 3 V: no facet missing, none twice, all outward."""
    mesh = distorted(box(SIZE, CELLS, element), 0.02)
    at = surface_points(mesh.points, mesh.skin())
    flux = at.area @ np.einsum("gi,gi->g", at.points, at.normals)
    assert flux == pytest.approx(3.0 * _volume(mesh), rel=1e-12)


def test_graded_lines_keep_breakpoints_and_counts() -> None:
    np.testing.assert_allclose(graded([0.0, 1.0, 4.0], [2, 3]), [0.0, 0.5, 1.0, 2.0, 3.0, 4.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("breakpoints", "cells", "message"),
    [
        ([0.0, 1.0], [1, 2], "one cell count per interval"),
        ([0.0], [], "one cell count per interval"),
        ([0.0, 1.0], [0], "at least 1"),
        ([0.0, 0.0], [1], "must increase"),
        ([1.0, 0.0], [1], "must increase"),
    ],
)
def test_bad_grid_lines_are_refused(breakpoints: list[float], cells: list[int], message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        graded(breakpoints, cells)


def test_blocks_of_other_elements_are_refused() -> None:
    line = np.array([0.0, 1.0])
    with pytest.raises(FemInputError, match="hex27 or tet10; got hex8"):
        hex_block(line, line, line, element="hex8")


def test_unknown_surface_lists_the_known_ones() -> None:
    with pytest.raises(FemInputError, match="known surfaces: x_max, x_min"):
        box(SIZE, CELLS).surface("top")


def test_inverted_cell_is_located() -> None:
    mesh = box(SIZE, CELLS)
    cells = mesh.cells.copy()
    cells[3] = cells[3, [4, 5, 6, 7, 0, 1, 2, 3, *range(12, 16), *range(8, 12), *range(16, 20)]]
    with pytest.raises(FemInputError, match=r"cell 3 at .*inverted cell"):
        single(Mesh(mesh.points, cells, mesh.element, mesh.surfaces))


def test_arch_lifts_the_middle_and_leaves_the_clamps() -> None:
    x = np.array([0.0, 0.05, 0.1, 0.15, 0.16])
    points = np.column_stack([x, np.zeros(5), np.ones(5)])
    lifted = arch(points, 1e-3, 0.3)
    np.testing.assert_allclose(lifted[:, 1], [1e-3, 0.75e-3, 0.25e-3, 0.0, 0.0], atol=1e-18)
    np.testing.assert_array_equal(lifted[:, [0, 2]], points[:, [0, 2]])
