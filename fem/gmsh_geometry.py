"""Geometry files meshed with second-order tetrahedra by Gmsh, an optional dependency."""

from __future__ import annotations

import importlib
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from fem.errors import FemInputError
from fem.mesh_file import MeshFile
from fem.meshio_files import read_msh

GEOMETRY = (".geo", ".step", ".stp", ".brep", ".iges")


def mesh_geometry(path: Path, mesh_size: float | None) -> MeshFile:
    """Mesh a geometry with TET10.

    Physical groups of a .geo file keep their names; where there are none, every volume and surface becomes a group of
    its own, volume_<tag> and surface_<tag>.

    Parameters
    ----------
    mesh_size : largest element edge in the unit of the file; None leaves it to the file and Gmsh.

    Raises
    ------
    FemInputError : Gmsh is not installed, or cannot read or mesh the file.
    """
    try:
        gmsh: Any = importlib.import_module("gmsh")
    except (ImportError, OSError) as error:
        advice = "pip install 'romgen[mesh]', or give a mesh file"
        raise FemInputError("Gmsh is not installed", where=path.name, value=str(error), advice=advice) from error
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        return _meshed(gmsh, path, mesh_size)
    except FemInputError:
        raise
    except Exception as error:  # Gmsh raises the bare class
        raise FemInputError("Gmsh cannot mesh this geometry", where=path.name, value=str(error)) from error
    finally:
        gmsh.finalize()


def _meshed(gmsh: Any, path: Path, mesh_size: float | None) -> MeshFile:
    gmsh.open(str(path))
    if not gmsh.model.getEntities(3):
        raise FemInputError("the geometry has no volume", where=path.name)
    if not gmsh.model.getPhysicalGroups():
        for dim in (2, 3):
            for _, tag in gmsh.model.getEntities(dim):
                gmsh.model.addPhysicalGroup(dim, [tag], tag)
    if mesh_size is not None:
        gmsh.option.setNumber("Mesh.MeshSizeMax", mesh_size)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 2)
    gmsh.model.mesh.generate(3)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.msh"
        gmsh.write(str(file))
        return replace(read_msh(file), path=path)
