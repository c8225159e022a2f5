"""Gmsh .msh and VTU files through meshio."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.errors import FemInputError
from fem.mesh_file import MeshFile

_SOLID = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "hexahedron27": "hex27",
}
_CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
_REFUSED = ("wedge", "pyramid")
_BODY_FIELDS = ("body", "group", "gmsh:physical", "medit:ref", "PartId")
"""Integer fields of the cells of a VTU file that number bodies and surfaces, the first one found counts."""


def read_msh(path: Path) -> MeshFile:
    """A Gmsh mesh: physical volumes become groups, physical surfaces surfaces, physical lines and points node sets.

    Groups without a name are called volume_<tag>, surface_<tag>, line_<tag>, point_<tag>.
    """
    mesh = _open("gmsh", path)
    names = {(int(dim), int(tag)): name for name, (tag, dim) in mesh.field_data.items()}
    tags = mesh.cell_data.get("gmsh:physical") or [np.zeros(len(block.data), dtype=np.int64) for block in mesh.cells]
    content = _Builder(path, mesh)
    for number, (block, tag) in enumerate(zip(mesh.cells, tags, strict=True)):
        dim = _dimension(block.type)
        for value in np.unique(tag[tag > 0]):
            kind = ("point", "line", "surface", "volume")[dim]
            content.add(number, np.flatnonzero(tag == value), names.get((dim, int(value)), f"{kind}_{value}"))
    for name, parts in mesh.cell_sets.items():
        # Sets know the cells that belong to several groups; the tags hold the first one only.
        for number, rows in enumerate(parts):
            if not name.startswith("gmsh:") and rows is not None and len(rows):
                content.add(number, np.asarray(rows), name)
    return content.finished()


def read_vtu(path: Path) -> MeshFile:
    """A VTU mesh: an integer field of the cells, such as "body", numbers bodies and surfaces: body_<n>, surface_<n>.

    Point fields that hold only 0 and 1 are node sets of their name.
    """
    mesh = _open("vtu", path)
    content = _Builder(path, mesh)
    field = next((name for name in _BODY_FIELDS if name in mesh.cell_data), None)
    for number, (block, tag) in enumerate(zip(mesh.cells, mesh.cell_data.get(field, []), strict=False)):
        kind = "body" if block.type in _SOLID else "surface"
        for value in np.unique(tag):
            content.add(number, np.flatnonzero(tag == value), f"{kind}_{int(value)}")
    sets = {}
    for name, values in mesh.point_data.items():
        if values.ndim == 1 and np.issubdtype(values.dtype, np.integer) and np.isin(values, (0, 1)).all():
            sets[name] = np.flatnonzero(values)
    return content.finished(sets)


def _open(module: str, path: Path) -> Any:
    try:
        reader = importlib.import_module(f"meshio.{module}")
    except ImportError as error:
        advice = "pip install 'romgen[fem]'"
        raise FemInputError("meshio is not installed", where=path.name, value=str(error), advice=advice) from error
    try:
        return reader.read(path)
    except Exception as error:  # whatever a broken file provokes in the parser
        advice = "save it again, as MSH 4.1 or as VTU"
        value = f"{type(error).__name__}: {error}"
        raise FemInputError("cannot read the mesh file", where=path.name, value=value, advice=advice) from error


def _dimension(kind: str) -> int:
    if kind in _SOLID or kind.startswith(_REFUSED):
        return 3
    if kind in _CORNERS:
        return 2
    return 0 if kind == "vertex" else 1


class _Builder:
    """Collects the blocks of a meshio mesh, which may hold one kind of cell many times."""

    def __init__(self, path: Path, mesh: Any) -> None:
        self._path, self._mesh = path, mesh
        self._points: FloatArray = np.zeros((len(mesh.points), 3))
        self._points[:, : mesh.points.shape[1]] = mesh.points
        self._first: dict[int, int] = {}
        self._cells: dict[str, list[IntArray]] = {}
        self._groups: dict[str, dict[str, list[IntArray]]] = {}
        self._facets: dict[str, list[IntArray]] = {}
        self._sets: dict[str, list[IntArray]] = {}
        for number, block in enumerate(mesh.cells):
            if block.type.startswith(_REFUSED):
                advice = "mesh with tetrahedra or hexahedra only"
                raise FemInputError("unsupported solid cells", where=path.name, value=block.type, advice=advice)
            if block.type in _SOLID:
                parts = self._cells.setdefault(_SOLID[block.type], [])
                self._first[number] = sum(len(part) for part in parts)
                parts.append(block.data.astype(np.int64))

    def add(self, number: int, rows: IntArray, name: str) -> None:
        """Put rows of a block into a group, surface or node set, whichever its cells are."""
        block = self._mesh.cells[number]
        if block.type in _SOLID:
            group = self._groups.setdefault(name, {}).setdefault(_SOLID[block.type], [])
            group.append(self._first[number] + rows.astype(np.int64))
        elif block.type in _CORNERS:
            corners = block.data[rows][:, : _CORNERS[block.type]]
            self._facets.setdefault(name, []).append(corners.astype(np.int64))
        else:
            self._sets.setdefault(name, []).append(block.data[rows].ravel().astype(np.int64))

    def finished(self, sets: dict[str, IntArray] | None = None) -> MeshFile:
        """The collected content."""
        return MeshFile(
            self._path,
            self._points,
            {element: np.vstack(parts) for element, parts in self._cells.items()},
            {
                name: {element: np.unique(np.concatenate(parts)) for element, parts in group.items()}
                for name, group in self._groups.items()
            },
            self._facets,
            {name: np.unique(np.concatenate(parts)) for name, parts in self._sets.items()} | (sets or {}),
        )
