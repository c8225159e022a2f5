"""Structured blocks of quadratic hexahedra or tetrahedra."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from fem.arrays import FloatArray, IntArray
from fem.bounds import require_count
from fem.element import reference_element
from fem.errors import FemInputError
from fem.finite_values import finite_array
from fem.mesh import Mesh

_SIDES = (
    ("x_min", 0, 0.0),
    ("x_max", 0, 1.0),
    ("y_min", 1, 0.0),
    ("y_max", 1, 1.0),
    ("z_min", 2, 0.0),
    ("z_max", 2, 1.0),
)
# Kuhn split of a cube with VTK corners: six tetrahedra around the diagonal 0-6; conforming between equal cubes.
_KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


def graded(breakpoints: Sequence[float], cells: Sequence[int]) -> FloatArray:
    """Grid lines with ``cells[i]`` equal intervals between ``breakpoints[i]`` and ``[i + 1]``, in m."""
    if len(cells) != len(breakpoints) - 1 or len(cells) == 0:
        raise FemInputError(
            "one cell count per interval is needed",
            where="block",
            value=f"{len(breakpoints)} breakpoints and {len(cells)} counts",
        )
    for count in cells:
        require_count("block", "a cell count", count, 1)
    if np.any(np.diff(breakpoints) <= 0.0):
        raise FemInputError("breakpoints must increase", where="block", value=list(breakpoints))
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(breakpoints, breakpoints[1:], cells, strict=False)]
    return np.concatenate([*parts, [breakpoints[-1]]])


def hex_block(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    z: npt.ArrayLike,
    *,
    element: str = "hex20",
    mapping: Callable[[FloatArray], FloatArray] | None = None,
) -> Mesh:
    """A block of quadratic cells over the grid lines x, y, z.

    Parameters
    ----------
    x, y, z : (n + 1,) increasing grid lines, m.
    element : "hex20" (serendipity), "hex27" (triquadratic), or "tet10": every hexahedron split into six tetrahedra.
    mapping : moves the (n_node, 3) points after the grid is laid; None keeps the box.

    Returns
    -------
    Mesh with the surfaces x_min, x_max, y_min, y_max, z_min, z_max.
    """
    if element not in {"hex20", "hex27", "tet10"}:
        raise FemInputError("blocks consist of hex20, hex27 or tet10", where="block", value=element)
    given = [_grid_lines(v, axis) for v, axis in zip((x, y, z), "xyz", strict=True)]
    lines = [_with_midpoints(v) for v in given]
    counts = [len(v) - 1 for v in given]
    grid = "hex27" if element == "tet10" else element
    offsets = np.rint(2 * reference_element(grid).nodes).astype(np.int64)
    cell = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    lattice = 2 * cell + offsets[None, :, :]
    shape = tuple(len(v) for v in lines)
    flat = np.ravel_multi_index(tuple(np.moveaxis(lattice, -1, 0)), shape)
    used, cells = np.unique(flat, return_inverse=True)
    ijk = np.unravel_index(used, shape)
    points = np.stack([line[i] for line, i in zip(lines, ijk, strict=True)], axis=1)
    cells = cells.reshape(flat.shape).astype(np.int64)
    moved = np.ascontiguousarray(points if mapping is None else mapping(points))
    if element == "tet10":
        cells = cells[:, _tetrahedra()].reshape(-1, 10)
        return Mesh(moved, cells, element, _plane_sides(Mesh(points, cells, element, {})))
    surfaces = {name: _side(cells, cell[:, 0, :], counts, element, axis, end) for name, axis, end in _SIDES}
    return Mesh(moved, cells, element, surfaces)


def arch(points: FloatArray, rise: float, span: float) -> FloatArray:
    """Raise a flat panel to a shallow arch: y += rise/2 (1 + cos(2 pi x / span)) for |x| < span/2.

    The slope is zero at mid-span and at the clamps; points (n_node, 3) and lengths in m.
    """
    x = points[:, 0]
    lift = np.where(np.abs(x) < 0.5 * span, 0.5 * rise * (1.0 + np.cos(2.0 * np.pi * x / span)), 0.0)
    return np.asarray(points + np.outer(lift, [0.0, 1.0, 0.0]))


def _grid_lines(v: npt.ArrayLike, axis: str) -> FloatArray:
    line = finite_array(v, (-1,), f"the grid lines along {axis}", where="block", advice="give increasing numbers")
    if len(line) < 2 or np.any(np.diff(line) <= 0.0):
        raise FemInputError(
            "at least two increasing grid lines are needed", where=f"block, {axis}", value=line.tolist()
        )
    return line


def _with_midpoints(v: FloatArray) -> FloatArray:
    line = np.empty(2 * len(v) - 1)
    line[::2], line[1::2] = v, 0.5 * (v[1:] + v[:-1])
    return line


def _tetrahedra() -> IntArray:
    """Local nodes of HEX27 that make up each of the six TET10, (6, 10)."""
    nodes, edges = reference_element("hex27").nodes, reference_element("tet10").edges
    corners = nodes[np.array(_KUHN)]
    places = np.concatenate([corners, corners[:, edges[:, :2]].mean(axis=2)], axis=1)
    return np.asarray(np.abs(places[:, :, None] - nodes[None, None]).max(axis=3).argmin(axis=2))


def _plane_sides(box: Mesh) -> dict[str, IntArray]:
    """The six sides of a block before it is mapped."""
    skin = box.skin()
    ends = {0.0: box.points.min(axis=0), 1.0: box.points.max(axis=0)}
    # Grid lines are copied, not computed: coordinates of a side are equal to the last bit.
    return {name: skin[(box.points[skin][:, :, axis] == ends[end][axis]).all(axis=1)] for name, axis, end in _SIDES}


def _side(cells: IntArray, index: IntArray, counts: list[int], element: str, axis: int, end: float) -> IntArray:
    reference = reference_element(element)
    on_side = [f for f in reference.faces if np.all(reference.nodes[f, axis] == end)]
    at_end = index[:, axis] == (counts[axis] - 1 if end else 0)
    return np.asarray(cells[at_end][:, on_side[0]])
