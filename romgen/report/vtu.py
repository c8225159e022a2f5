"""Field output for ParaView: VTU files (XML, inline base64) and PVD collections of them."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from romgen.errors import InputError
from romgen.structure import Structure

# VTK cell types (vtkCellType.h) of the quadratic elements.
CELL_TYPES = {"tet10": 24, "hex20": 25, "hex27": 29}
_VTK_NAMES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "u1": "UInt8"}

Fields = Mapping[str, npt.NDArray[np.generic]]


def _data_array(name: str, values: npt.NDArray[np.generic]) -> str:
    """One DataArray element; the payload is an 8-byte length followed by the numbers, little endian."""
    kind = f"{values.dtype.kind}{values.dtype.itemsize}"
    if kind not in _VTK_NAMES:
        raise InputError("VTU holds no such number type", where=f"field {name}", value=str(values.dtype))
    payload = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(len(payload).to_bytes(8, "little") + payload).decode("ascii")
    components = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{_VTK_NAMES[kind]}" Name={quoteattr(name)} '
        f'NumberOfComponents="{components}" format="binary">{text}</DataArray>\n'
    )


def _checked(fields: Fields, n_row: int, where: str) -> str:
    """All fields of one kind as DataArray elements."""
    for name, values in fields.items():
        if values.ndim not in (1, 2) or values.shape[0] != n_row:
            raise InputError("the field has another length than the mesh", where=f"{where} {name}", value=values.shape)
    return "".join(_data_array(name, values) for name, values in fields.items())


def write_vtu(path: Path, structure: Structure, point_fields: Fields, cell_fields: Fields | None = None) -> None:
    """Write the mesh with fields at its nodes and cells; the file appears complete or not at all.

    Parameters
    ----------
    path : file to write.
    structure : the mesh; its cells are already in VTK order.
    point_fields : name -> (n_node,) or (n_node, n_component), SI units in the name, e.g. "displacement [m]".
    cell_fields : name -> (n_cell,) or (n_cell, n_component); the body index is always written.

    Raises
    ------
    InputError : a field of another length, or a number type that VTU does not hold.

    Source: Kitware, VTK File Formats, UnstructuredGrid.
    """
    n_node, n_cell = structure.points.shape[0], structure.cells.shape[0]
    used = structure.cells >= 0
    offsets = np.cumsum(used.sum(axis=1), dtype=np.int64)
    types = np.array([CELL_TYPES[kind] for kind in structure.cell_types], dtype=np.uint8)[structure.cell_body]
    points = _data_array("points", structure.points)
    topology = (
        _data_array("connectivity", structure.cells[used])
        + _data_array("offsets", offsets)
        + _data_array("types", types)
    )
    at_cells = {"body": structure.cell_body, **(cell_fields or {})}
    text = (
        '<?xml version="1.0"?>\n'
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{n_node}" NumberOfCells="{n_cell}">\n'
        f"<Points>\n{points}</Points>\n<Cells>\n{topology}</Cells>\n"
        f"<PointData>\n{_checked(point_fields, n_node, 'point field')}</PointData>\n"
        f"<CellData>\n{_checked(at_cells, n_cell, 'cell field')}</CellData>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )
    _write_atomic(path, text)


def write_pvd(path: Path, times: Sequence[float], files: Sequence[Path]) -> None:
    """Write a ParaView collection: one VTU file per time in s, named relative to the collection.

    Raises
    ------
    InputError : the numbers of times and files differ.
    """
    if len(times) != len(files):
        raise InputError("times and files differ in number", where=str(path), value=(len(times), len(files)))
    entries = "".join(
        f'<DataSet timestep="{time!r}" part="0" file={quoteattr(os.path.relpath(file, path.parent))}/>\n'
        for time, file in zip(map(float, times), files, strict=True)
    )
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n'
    _write_atomic(path, f"{head}<Collection>\n{entries}</Collection>\n</VTKFile>\n")


def _write_atomic(path: Path, text: str) -> None:
    """Write beside the target and rename, so a killed run leaves no half file."""
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="ascii")
    partial.replace(path)
