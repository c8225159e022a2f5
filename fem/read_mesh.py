"""Bodies from mesh files: Gmsh .msh, Abaqus and CalculiX .inp, VTU, and geometry that Gmsh meshes."""

from __future__ import annotations

from pathlib import Path

from fem.errors import FemInputError
from fem.gmsh_geometry import GEOMETRY, mesh_geometry
from fem.inp_file import read_inp
from fem.mesh import Mesh
from fem.mesh_file import MeshFile, cut_body
from fem.meshio_files import read_msh, read_vtu

_READERS = {".msh": read_msh, ".inp": read_inp, ".vtu": read_vtu}


def open_mesh_file(path: Path | str, *, mesh_size: float | None = None) -> MeshFile:
    """Read a mesh file by its ending: .msh, .inp, .vtu; mesh a geometry (.geo, .step, .stp, .brep, .iges).

    Parameters
    ----------
    mesh_size : largest element edge in the unit of the file; only for geometry.

    Raises
    ------
    FemInputError : no such file, another ending, a file that cannot be read, or one without solid cells.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if not path.is_file():
        raise FemInputError("no such mesh file", where=str(path))
    if ending in GEOMETRY:
        content = mesh_geometry(path, mesh_size)
    elif ending in _READERS:
        content = _READERS[ending](path)
    else:
        advice = f"known are {', '.join((*_READERS, *GEOMETRY))}"
        raise FemInputError("unknown kind of mesh file", where=path.name, value=path.suffix, advice=advice)
    if not content.cells:
        advice = "save the volume elements too: TET10, HEX20 or HEX27"
        raise FemInputError("the file has no solid cells", where=path.name, advice=advice)
    return content


def read_mesh(
    path: Path | str,
    *,
    group: str | None = None,
    unit: float = 1.0,
    raise_order: bool = False,
    mesh_size: float | None = None,
) -> Mesh:
    """One body from a mesh or geometry file; see ``open_mesh_file`` and ``cut_body``."""
    content = open_mesh_file(path, mesh_size=mesh_size)
    return cut_body(content, group=group, unit=unit, raise_order=raise_order)
