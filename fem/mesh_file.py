"""What a mesh file holds, and bodies cut out of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.element import reference_element
from fem.errors import FemInputError
from fem.mesh import Mesh

LINEAR = {"tet4": "tet10", "hex8": "hex20"}
_N_CORNER = {"tet4": 4, "tet10": 4, "hex8": 8, "hex20": 8, "hex27": 8}
_OFF_EDGE = 0.3
"""Middle nodes farther than this share of the edge length from the middle mean another node order."""


@dataclass(frozen=True)
class MeshFile:
    """What a mesh file holds, before bodies are cut out of it.

    Attributes
    ----------
    path : where it came from, for messages.
    points : (n_point, 3) in the unit of the file.
    cells : element -> (n_cell, n_local) rows of ``points``, VTK order.
    groups : name of a set of cells -> element -> rows of ``cells``.
    facets : name of a surface -> (n_facet, 3 or 4) arrays of corner nodes, any orientation.
    node_sets : name -> (n,) rows of ``points``.
    """

    path: Path
    points: FloatArray
    cells: dict[str, IntArray]
    groups: dict[str, dict[str, IntArray]]
    facets: dict[str, list[IntArray]]
    node_sets: dict[str, IntArray]


def cut_body(content: MeshFile, *, group: str | None = None, unit: float = 1.0, raise_order: bool = False) -> Mesh:
    """One body out of an open mesh file, with the surfaces and node sets that lie on it.

    A node set that holds all nodes of outer faces becomes a surface of the same name as well.

    Parameters
    ----------
    group : name of its cells (physical group, element set, body number); None takes all solid cells of the file.
    unit : length of one file unit in m, 1e-3 for a mesh in mm.
    raise_order : give linear cells straight middle nodes (TET4 to TET10, HEX8 to HEX20); without it they are refused,
        since their own shape functions lock in bending.

    Raises
    ------
    FemInputError : an unknown group, cells of several kinds, linear cells, a node order that is not that of the format.
    """
    where = content.path.name
    element, cells = _chosen(content, group)
    used, local = np.unique(cells, return_inverse=True)
    cells, points = local.reshape(cells.shape), unit * content.points[used]
    number = np.full(len(content.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    sets = {name: number[nodes][number[nodes] >= 0] for name, nodes in content.node_sets.items()}
    if element in LINEAR:
        if not raise_order:
            advice = f"mesh with second-order elements, or set raise_order to make {LINEAR[element]} of them"
            raise FemInputError(f"linear elements ({element}) lock in bending", where=where, advice=advice)
        points, cells, edges = _with_middle_nodes(points, cells, element)
        first = len(used)
        sets = {
            name: np.concatenate([nodes, first + np.flatnonzero(np.isin(edges, nodes).all(axis=1))])
            for name, nodes in sets.items()
        }
        element = LINEAR[element]
    _check_order(points, cells, element, where)
    mesh = Mesh(np.ascontiguousarray(points), np.ascontiguousarray(cells), element, {})
    surfaces = {name: _matching(mesh, [number[part] for part in parts]) for name, parts in content.facets.items()}
    surfaces = {name: facets for name, facets in surfaces.items() if len(facets)}
    sets = {name: np.unique(nodes) for name, nodes in sets.items() if len(nodes)}
    skin = mesh.skin()
    for name, nodes in sets.items():
        whole = skin[np.isin(skin, nodes).all(axis=1)]
        if name not in surfaces and len(whole):
            surfaces[name] = whole
    return Mesh(mesh.points, mesh.cells, element, surfaces, sets)


def _chosen(content: MeshFile, group: str | None) -> tuple[str, IntArray]:
    """Element and cells of a group, or of the whole file."""
    if group is None:
        rows = {element: np.arange(len(cells)) for element, cells in content.cells.items()}
    elif group in content.groups:
        rows = content.groups[group]
    else:
        known = ", ".join(content.groups) or "none"
        advice = f"groups of cells in the file: {known}"
        raise FemInputError("unknown group", where=content.path.name, value=group, advice=advice)
    rows = {element: chosen for element, chosen in rows.items() if len(chosen)}
    if len(rows) != 1:
        value = ", ".join(f"{len(chosen)} {element}" for element, chosen in rows.items()) or "no cells"
        advice = "a body has one kind of element: make groups of one kind and join them by a tie"
        raise FemInputError("cells of several kinds", where=content.path.name, value=value, advice=advice)
    ((element, chosen),) = rows.items()
    return element, content.cells[element][chosen]


def _with_middle_nodes(points: FloatArray, cells: IntArray, element: str) -> tuple[FloatArray, IntArray, IntArray]:
    """Points and cells with straight middle nodes, and the ends (n_edge, 2) of the edges they lie on."""
    ends = reference_element(LINEAR[element]).edges[:, :2]
    pairs = np.sort(cells[:, ends], axis=2).reshape(-1, 2)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    cells = np.hstack([cells, len(points) + number.reshape(len(cells), -1)])
    return np.vstack([points, points[edges].mean(axis=1)]), cells, edges


def _check_order(points: FloatArray, cells: IntArray, element: str, where: str) -> None:
    """Every middle node must lie near the middle of its edge."""
    at = points[cells[:, reference_element(element).edges]]
    length = np.linalg.norm(at[:, :, 1] - at[:, :, 0], axis=2)
    off = np.linalg.norm(at[:, :, 2] - 0.5 * (at[:, :, 0] + at[:, :, 1]), axis=2)
    worst = np.argmax(off - _OFF_EDGE * length)
    cell, edge = np.unravel_index(worst, off.shape)
    if off[cell, edge] > _OFF_EDGE * length[cell, edge]:
        raise FemInputError(
            "a middle node is far from the middle of its edge",
            where=f"{where}, {element} near {at[cell, edge, 0].round(6)}",
            value=f"{off[cell, edge] / max(length[cell, edge], 1e-300):.2f} edge lengths",
            advice="the node order is not that of the format, or the cell is badly shaped",
        )


def _matching(mesh: Mesh, parts: list[IntArray]) -> IntArray:
    """Faces of the mesh, outward, that have the given corner nodes; -1 among them stands for a node elsewhere."""
    n_corner = 3 if mesh.element == "tet10" else 4
    wanted = [part for part in parts if part.shape[1] == n_corner]
    facets = mesh.facets()
    if not wanted:
        return facets[:0]
    keys = np.sort(facets[:, :n_corner], axis=1)
    corners = np.sort(np.vstack(wanted), axis=1)
    both, number = np.unique(np.vstack([keys, corners]), axis=0, return_inverse=True)
    marked = np.zeros(len(both), dtype=bool)
    marked[number.ravel()[len(keys) :]] = True
    return np.asarray(facets[marked[number.ravel()[: len(keys)]]])
