"""The depth-buffer renderer: what is in front is seen, fields are interpolated."""

from __future__ import annotations

import itertools

import numpy as np

from romgen.report.raster import rasterise
from romgen.report.skin import mesh_edges, triangle_body, view_frame
from romgen.structure import Structure

# A near square of half the size before a far one.
SEEN = np.array(
    [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 1], [3, 1, 1], [3, 3, 1], [1, 3, 1]],
    dtype=float,
)
TRIANGLES = np.array([[4, 5, 6], [4, 6, 7], [0, 1, 2], [0, 2, 3]])
ALL_EDGES = np.ones((4, 3), dtype=bool)


def test_the_nearer_face_wins_whatever_the_order() -> None:
    """The centre sees the near square, the rim the far one, also with the triangles listed backwards."""
    for order in ([0, 1, 2, 3], [3, 2, 1, 0]):
        raster = rasterise(SEEN, TRIANGLES[order], ALL_EDGES, 204)
        seen = np.array(order)[raster.triangle]
        assert set(np.unique(seen[60:140, 60:140])) <= {0, 1}
        assert set(np.unique(seen[10:40, 10:190])) <= {2, 3}
        assert np.all(raster.triangle[0] == -1)


def test_fields_are_interpolated_linearly() -> None:
    """x itself as a nodal field comes back as the position of the pixel."""
    raster = rasterise(SEEN, TRIANGLES, ALL_EDGES, 204)
    value = np.einsum("rck,rck->rc", raster.weights, SEEN[TRIANGLES[raster.triangle], 0])
    left, right = raster.extent[:2]
    columns = left + (np.arange(204) + 0.5) * (right - left) / 204
    hit = raster.triangle >= 0
    np.testing.assert_allclose(value[hit], np.broadcast_to(columns, value.shape)[hit], atol=1e-12)


def test_distance_to_drawn_edges() -> None:
    """With one drawn edge the distance is that to its line, in pixels."""
    drawn = np.zeros((4, 3), dtype=bool)
    drawn[2, 2] = True  # the edge 0-1 of triangle (0, 1, 2), on y = 0
    raster = rasterise(SEEN, TRIANGLES, drawn, 204)
    row = 11
    assert raster.edge_px[row, 150] == np.float64(row + 0.5 - 2.0).round(12) or np.isclose(
        raster.edge_px[row, 150], 9.5
    )
    assert np.isinf(raster.edge_px[190, 20])


def test_view_lays_the_structure_flat() -> None:
    """An orthonormal right-handed frame; the shortest extent points up, the longest runs to the right."""
    for extents in itertools.permutations((1.0, 2.0, 3.0)):
        frame = view_frame(np.array([[0.0, 0.0, 0.0], extents]))
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(np.cross(frame[0], frame[1]), frame[2], atol=1e-15)
        assert np.argmax(frame[1]) == np.argmin(extents)
        assert np.argmax(frame[0]) == np.argmax(extents)


def test_diagonals_of_quadrilaterals_are_no_mesh_edges(structure: Structure) -> None:
    """Each skin triangle of a hexahedron has two element edges and one diagonal."""
    assert np.all(mesh_edges(structure).sum(axis=1) == 2)


def test_skin_triangles_know_their_body(structure: Structure) -> None:
    """The bodies do not share nodes here, so the points decide."""
    body = triangle_body(structure)
    z = structure.points[structure.skin, 2].mean(axis=1)
    assert np.all(z[body == 1] <= 0.0)
    assert np.all(z[body == 2] >= 0.0015)
    assert set(body) == {0, 1, 2}
