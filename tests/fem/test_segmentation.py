"""Integration segments between non-matching surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from fem.arrays import FloatArray
from fem.block import graded, hex_block
from fem.mesh import Mesh
from fem.pairing import project, surface_points
from fem.polygons import MAX_CORNERS, areas, clip, integration_points, straighten
from fem.segmentation import segment_points
from tests.fem.small_models import box

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def _clipped(corners: FloatArray) -> FloatArray:
    polygons = np.zeros((1, MAX_CORNERS, 2))
    polygons[0, : len(corners)] = corners
    counts = np.array([len(corners)])
    clip(polygons, counts, SQUARE)
    straighten(polygons, counts)
    return polygons[0, : counts[0]]


def test_clipping_a_diamond_leaves_an_octagon() -> None:
    """The diamond abs(x - 1/2) + abs(y - 1/2) <= 3/4 loses four corners of height 1/4: area 9/8 - 4/16."""
    diamond = np.array([[1.25, 0.5], [0.5, 1.25], [-0.25, 0.5], [0.5, -0.25]])
    left = _clipped(diamond)
    assert len(left) == 8
    assert areas(np.vstack([left, np.zeros((MAX_CORNERS - 8, 2))])[None], np.array([8]))[0] == pytest.approx(0.875)


def test_clipping_forgets_repeated_and_straight_corners() -> None:
    corners = np.array([[0.2, 0.0], [0.5, 0.0], [0.8, 0.0], [0.8, 0.0], [0.8, 1.0], [0.2, 1.0], [0.2, 0.0]])
    assert len(_clipped(corners)) == 4
    assert len(_clipped(corners + 2.0)) == 0


@pytest.mark.parametrize(("sides", "degree"), [(3, 4), (4, 4), (5, 4), (7, 4)])
def test_points_of_a_polygon_integrate_polynomials(sides: int, degree: int) -> None:
    """Against Green's theorem on the edges with 8 Gauss points, all monomials up to the degree."""
    angle = 2.0 * np.pi * (np.arange(sides) + 0.2 * np.sin(5.0 * np.arange(sides))) / sides
    corners = 0.5 + np.column_stack([0.4 * np.cos(angle), 0.3 * np.sin(angle)])
    x, w = integration_points(corners, full=True)
    t, g = np.polynomial.legendre.leggauss(8)
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            exact = 0.0
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                at = a + 0.5 * (1.0 + t)[:, None] * (b - a)
                exact += 0.5 * (b - a)[1] * g @ (at[:, 0] ** (i + 1) * at[:, 1] ** j) / (i + 1)
            assert w @ (x[:, 0] ** i * x[:, 1] ** j) == pytest.approx(exact, rel=1e-13)


def _stacked(lower: Mesh, upper: Mesh) -> tuple[FloatArray, FloatArray, FloatArray]:
    points = np.vstack([lower.points, upper.points])
    return points, upper.surface("y_min") + len(lower.points), lower.surface("y_max")


def _skewed(size: float, cells: tuple[int, int, int], *, raised: float = 0.0) -> Mesh:
    def bend(points: FloatArray) -> FloatArray:
        x, y, z = points.T
        shift = size * np.column_stack([np.sin(3.0 * z) * x * (1.0 - x), 0.0 * y, np.cos(2.0 * x) * z * (1.0 - z)])
        return np.asarray(points + shift)

    lines = [graded([0.0, 1.0], [n]) for n in cells]
    return hex_block(lines[0], lines[1] + raised, lines[2], mapping=bend)


def _nodal_misfit(points: FloatArray, slave: FloatArray, master: FloatArray) -> float:
    """Nodal forces of a unit pressure from the segments against those of each surface's own rule, relative."""
    at = segment_points(points, slave, master, 0.1)
    target = project(points, at.points, master, 0.1, slack=0.05)
    assert target.found.all()
    force = np.zeros(len(points))
    np.add.at(force, at.nodes, at.area[:, None] * at.shape)
    np.add.at(force, target.nodes, -at.area[:, None] * target.shape)
    for facets, sign in ((slave, 1.0), (master, -1.0)):
        own = surface_points(points, facets)
        np.add.at(force, own.nodes, -sign * own.area[:, None] * own.shape)
    return float(np.abs(force).max() / at.area.max())


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
@pytest.mark.parametrize("cells", [(2, 3), (3, 2), (3, 4), (1, 5)])
def test_uniform_pressure_meets_the_nodes_of_both_sides(element: str, cells: tuple[int, int]) -> None:
    """The patch test of the interface alone: exact for straight edges."""
    n, m = cells
    lower, upper = box((1.0, 1.0, 1.0), (m, 1, m), element), box((1.0, 1.0, 1.0), (n, 1, n), element, shift=1.0)
    assert _nodal_misfit(*_stacked(lower, upper)) < 1e-12


def test_curved_grid_lines_are_met_to_second_order() -> None:
    """Edges are followed by chords: their distance from the edge enters squared, so halving the bend quarters it."""
    misfit = [_nodal_misfit(*_stacked(_skewed(s, (4, 1, 5)), _skewed(-s, (3, 1, 3), raised=1.0))) for s in (0.1, 0.05)]
    assert misfit[0] < 2e-3
    assert misfit[1] < 0.4 * misfit[0]


def test_matching_facets_keep_their_own_rule() -> None:
    """Bit for bit the points of the facets, so that a matching joint costs what it did."""
    points, slave, master = _stacked(box((1.0, 1.0, 1.0), (3, 1, 2)), box((1.0, 1.0, 1.0), (3, 1, 2), shift=1.0))
    at, own = segment_points(points, slave, master, 0.1), surface_points(points, slave)
    for name in vars(own):
        np.testing.assert_array_equal(getattr(at, name), getattr(own, name))


def test_only_the_covered_part_of_a_facet_has_points() -> None:
    """A slave that hangs over: area of the overlap, not of whole facets."""
    lower = box((0.55, 1.0, 1.0), (1, 1, 1))
    points, slave, master = _stacked(lower, box((1.0, 1.0, 1.0), (2, 1, 3), shift=1.0))
    assert segment_points(points, slave, master, 0.1).area.sum() == pytest.approx(0.55, rel=1e-12)
