"""VTU and PVD read back by another library, node order checked on curved elements."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.report.field_files import write_mode_fields, write_preload_field, write_snapshot_series
from romgen.report.vtu import write_pvd, write_vtu
from romgen.structure import Modes, Preload, Structure
from romgen.trajectory import Trajectory

meshio = pytest.importorskip("meshio", reason="the VTU round trip is read with meshio")

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
HEX_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
# VTK's triquadratic hexahedron: faces -x, +x, -y, +y, -z, +z, then the centre.
HEX_FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 1, 2, 3], [4, 5, 6, 7]])
TET_EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
MESHIO_NAMES = {"hex20": "hexahedron20", "hex27": "hexahedron27", "tet10": "tetra10"}


def bend(points: np.ndarray) -> np.ndarray:
    """A smooth curved map, different at every node."""
    x, y, z = points.T
    return np.column_stack([x + 0.1 * y * z, y + 0.15 * x**2, z + 0.2 * x * (1 - x) + 0.05 * y**2])


def one_element(cell_type: str) -> Structure:
    """One curved element of the type, nodes in VTK order."""
    corners = CORNERS[[0, 1, 3, 4]] if cell_type == "tet10" else CORNERS
    edges = TET_EDGES if cell_type == "tet10" else HEX_EDGES
    points = [corners, corners[edges].mean(axis=1)]
    if cell_type == "hex27":
        points += [corners[HEX_FACES].mean(axis=1), corners.mean(axis=0, keepdims=True)]
    straight = np.vstack(points)
    cells = np.arange(len(straight))[None]
    skin = np.array([[0, 1, 2]])
    return Structure(bend(straight), cells, (cell_type,), np.array([0]), ("body",), skin)


@pytest.mark.parametrize("cell_type", ["hex20", "hex27", "tet10"])
def test_curved_element_round_trip(tmp_path: Path, cell_type: str) -> None:
    """Type, node order, coordinates, and point and cell fields survive exactly."""
    structure = one_element(cell_type)
    vector, scalar = structure.points**2, np.arange(len(structure.points), dtype=np.int64)
    write_vtu(tmp_path / "e.vtu", structure, {"u [m]": vector, "number": scalar}, {"stress [Pa]": np.array([2.5e8])})
    mesh = meshio.read(tmp_path / "e.vtu")
    assert [block.type for block in mesh.cells] == [MESHIO_NAMES[cell_type]]
    np.testing.assert_array_equal(mesh.points, structure.points)
    np.testing.assert_array_equal(mesh.cells[0].data, structure.cells)
    np.testing.assert_array_equal(mesh.point_data["u [m]"], vector)
    np.testing.assert_array_equal(mesh.point_data["number"].ravel(), scalar)
    np.testing.assert_array_equal(np.ravel(mesh.cell_data["stress [Pa]"][0]), [2.5e8])
    np.testing.assert_array_equal(np.ravel(mesh.cell_data["body"][0]), [0])


@pytest.mark.parametrize("cell_type", ["hex20", "hex27", "tet10"])
def test_middle_nodes_stay_on_their_edges(tmp_path: Path, cell_type: str) -> None:
    """After the trip every middle node is the bent image of the middle of its own edge in VTK's numbering."""
    structure = one_element(cell_type)
    write_vtu(tmp_path / "e.vtu", structure, {})
    mesh = meshio.read(tmp_path / "e.vtu")
    nodes = mesh.points[mesh.cells[0].data[0]]
    corners = CORNERS[[0, 1, 3, 4]] if cell_type == "tet10" else CORNERS
    edges = TET_EDGES if cell_type == "tet10" else HEX_EDGES
    first = len(corners)
    np.testing.assert_array_equal(nodes[first : first + len(edges)], bend(corners[edges].mean(axis=1)))


def test_wrong_fields_are_refused(tmp_path: Path) -> None:
    """A field of another length and a complex field name themselves."""
    structure = one_element("hex20")
    with pytest.raises(InputError, match="point field u"):
        write_vtu(tmp_path / "e.vtu", structure, {"u": np.zeros((3, 3))})
    with pytest.raises(InputError, match="complex128"):
        write_vtu(tmp_path / "e.vtu", structure, {"u": np.zeros(20, dtype=complex)})
    assert not list(tmp_path.iterdir())


def test_collection_names_files_relative_to_itself(tmp_path: Path) -> None:
    """Times and relative names in order; unequal numbers are refused."""
    (tmp_path / "steps").mkdir()
    files = [tmp_path / "steps" / f"s{k}.vtu" for k in range(2)]
    write_pvd(tmp_path / "all.pvd", [0.0, 0.1], files)
    entries = ET.parse(tmp_path / "all.pvd").getroot().iter("DataSet")
    assert [(float(e.attrib["timestep"]), e.attrib["file"]) for e in entries] == [
        (0.0, "steps/s0.vtu"),
        (0.1, "steps/s1.vtu"),
    ]
    with pytest.raises(InputError, match="differ in number"):
        write_pvd(tmp_path / "bad.pvd", [0.0], files)


def test_preload_and_modes_are_vectors_at_the_nodes(
    tmp_path: Path, structure: Structure, preload: Preload, modes: Modes
) -> None:
    """Degree of freedom 3 node + component becomes component of node."""
    static = meshio.read(write_preload_field(tmp_path, structure, preload))
    np.testing.assert_array_equal(static.point_data["preload displacement [m]"][:, 2], preload.displacement[2::3])
    shapes = meshio.read(write_mode_fields(tmp_path, structure, modes)).point_data
    assert len(shapes) == modes.frequency_hz.size
    np.testing.assert_array_equal(shapes["mode 2, 198.80 Hz [kg^-0.5]"].ravel(), modes.shapes[:, 1])


def test_snapshots_become_a_time_series(tmp_path: Path, structure: Structure) -> None:
    """At most the wished number of files, at the times of their snapshots."""
    t = np.linspace(0.0, 1.0, 101)
    rows = np.arange(0, 101, 10)
    fields = np.outer(t[rows], np.ones(structure.points.size)).astype(np.float32)
    motion = Trajectory("free", t, ("a",), t[:, None], snapshots=fields, snapshot_index=rows)
    collection, *files = write_snapshot_series(tmp_path, structure, motion, most=4)
    times = [float(e.attrib["timestep"]) for e in ET.parse(collection).getroot().iter("DataSet")]
    assert times == pytest.approx([0.0, 0.3, 0.7, 1.0])
    assert len(files) == 4
    last = meshio.read(files[-1]).point_data["displacement [m]"]
    np.testing.assert_array_equal(last.ravel(), fields[-1])
    assert write_snapshot_series(tmp_path, structure, Trajectory("bare", t, ("a",), t[:, None])) == ()
