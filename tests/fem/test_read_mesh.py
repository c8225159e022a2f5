"""Meshes from files: node orders, groups, surfaces, units; what is refused."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import meshio
import numpy as np
import pytest

from fem.assembly import physical_gradients
from fem.element import reference_element
from fem.errors import FemInputError
from fem.mesh import Mesh
from fem.pairing import surface_points
from fem.read_mesh import open_mesh_file, read_mesh
from tests.fem.small_models import box, distorted, single

MESHES = Path(__file__).parent / "meshes"
ELEMENTS = ("tet10", "hex20", "hex27")
_MESHIO = {
    "tet10": ("tetra10", "triangle6"),
    "hex20": ("hexahedron20", "quad8"),
    "hex27": ("hexahedron27", "quad9"),
}


def _volume(mesh: Mesh) -> float:
    reference = reference_element(mesh.element)
    return float(physical_gradients(reference, reference.mass_rule(), mesh.points, mesh.cells)[1].sum())


def _area(mesh: Mesh, name: str) -> float:
    return float(surface_points(mesh.points, mesh.surface(name)).area.sum())


@pytest.mark.parametrize("file", [f"pipe_{e}.msh" for e in ELEMENTS] + ["pipe_hex20.inp", "pipe_tet10.inp"])
def test_quarter_pipe_meshed_by_gmsh(file: str) -> None:
    """Radii 10 and 20, height 8 mm: volume and areas, and thus node orders, which Gmsh wrote in both formats.

    A quadratic arc through three points of a circle, of 45 degrees or less, encloses its area to 1e-3 (the error of
    Simpson's rule on it is (pi/4)^4/180 = 2e-3 for the area under the arc, less for the sum).
    """
    mesh = read_mesh(MESHES / file, unit=1e-3)
    ring = 0.25 * np.pi * (0.02**2 - 0.01**2)
    assert _volume(mesh) == pytest.approx(ring * 0.008, rel=2e-3)
    assert _area(mesh, "top") == pytest.approx(ring, rel=2e-3)
    assert _area(mesh, "bottom") == pytest.approx(ring, rel=2e-3)
    assert _area(mesh, "bore") == pytest.approx(0.5 * np.pi * 0.01 * 0.008, rel=2e-3)
    assert np.all(mesh.points[mesh.surface("top")][..., 2] == pytest.approx(0.008, abs=1e-12))
    normals = surface_points(mesh.points, mesh.surface("top")).normals
    np.testing.assert_allclose(normals, np.broadcast_to([0.0, 0.0, 1.0], normals.shape), atol=1e-9)
    assert mesh.points[mesh.nodes("corner")] == pytest.approx(np.array([[0.02, 0.0, 0.0]]), abs=1e-9)
    edge = mesh.points[mesh.nodes("edge")]
    assert len(edge) >= 3
    np.testing.assert_allclose(edge[:, 1:], 0.0, atol=1e-12)
    # The file as one group is the same body.
    np.testing.assert_array_equal(read_mesh(MESHES / file, unit=1e-3, group="pipe").cells, mesh.cells)
    assert np.linalg.norm(mesh.points[mesh.nodes("bore")][:, :2], axis=1) == pytest.approx(0.01, rel=1e-6)


def _written(mesh: Mesh, path: Path, form: str) -> Path:
    """The mesh with its surface x_max in a file that meshio writes."""
    solid, facet = _MESHIO[mesh.element]
    top = mesh.surface("x_max")
    blocks = [(solid, mesh.cells), (facet, top)]
    tags = [np.full(len(mesh.cells), 1), np.full(len(top), 2)]
    if form == "gmsh":
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        names = {"block": np.array([1, 3]), "end": np.array([2, 2])}
        meshio.write(path, meshio.Mesh(mesh.points, blocks, cell_data=data, field_data=names), file_format="gmsh22")
    elif form == "vtu":
        marked = np.zeros(len(mesh.points), dtype=np.int64)
        marked[mesh.nodes("y_min")] = 1
        meshio.write(path, meshio.Mesh(mesh.points, blocks, cell_data={"body": tags}, point_data={"low": marked}))
    else:
        meshio.write(path, meshio.Mesh(mesh.points, blocks[:1]), file_format="abaqus")
    return path


# meshio writes no C3D27; test_inp_finds_the_middle_nodes_of_27_node_bricks reads one.
@pytest.mark.parametrize(
    ("element", "form"), [(e, f) for e in ELEMENTS for f in ("gmsh", "vtu", "abaqus") if (e, f) != ("hex27", "abaqus")]
)
def test_round_trip_keeps_every_node_of_every_cell(element: str, form: str, tmp_path: Path) -> None:
    mesh = distorted(box((1.0, 0.8, 0.6), (2, 2, 1), element), 0.05)
    suffix = {"gmsh": ".msh", "vtu": ".vtu", "abaqus": ".inp"}[form]
    read = read_mesh(_written(mesh, tmp_path / f"mesh{suffix}", form))
    assert read.element == element
    np.testing.assert_allclose(read.points[read.cells], mesh.points[mesh.cells], rtol=1e-14)
    end = {"gmsh": "end", "vtu": "surface_2"}.get(form)
    if end is not None:
        # The faces come from the cells, outward, in whatever order; as sets of points they are those written.
        centre = np.sort(mesh.points[mesh.surface("x_max")].mean(axis=1), axis=0)
        np.testing.assert_allclose(np.sort(read.points[read.surface(end)].mean(axis=1), axis=0), centre, rtol=1e-13)
    if form == "vtu":
        assert _area(read, "low") == pytest.approx(_area(mesh, "y_min"), rel=1e-12)


def _inp(mesh: Mesh, order: list[int], kind: str) -> str:
    nodes = "".join(f"{i + 1}, {x!r}, {y!r}, {z!r}\n" for i, (x, y, z) in enumerate(mesh.points.tolist()))
    rows = []
    for number, cell in enumerate(mesh.cells[:, order] + 1):
        text = [str(v) for v in (number + 1, *cell)]
        rows += [", ".join(text[k : k + 16]) + ("," if k + 16 < len(text) else "") for k in range(0, len(text), 16)]
    return f"*NODE, NSET=all\n{nodes}*ELEMENT, TYPE={kind}, ELSET=solid\n" + "\n".join(rows) + "\n"


def test_inp_finds_the_middle_nodes_of_27_node_bricks(tmp_path: Path) -> None:
    """The centre before the faces, as in Abaqus; faces in another order than VTK."""
    mesh = distorted(box((1.0, 0.8, 0.6), (2, 1, 1), "hex27"), 0.05)
    path = tmp_path / "brick.inp"
    path.write_text(_inp(mesh, [*range(20), 26, 24, 25, 22, 21, 23, 20], "C3D27"))
    read = read_mesh(path)
    np.testing.assert_allclose(read.points[read.cells], mesh.points[mesh.cells], rtol=1e-14)


@pytest.mark.parametrize(("element", "kind"), [("hex20", "C3D20R"), ("tet10", "C3D10")])
def test_inp_sets_and_surfaces(element: str, kind: str, tmp_path: Path) -> None:
    """Face labels S1, ...: the surface of all faces with one label is checked against the skin by area and side."""
    mesh = box((1.0, 0.8, 0.6), (2, 1, 1), element)
    text = _inp(mesh, list(range(mesh.cells.shape[1])), kind)
    n_face = len(reference_element(element).faces)
    text += f"*ELSET, ELSET=Half, GENERATE\n1, {len(mesh.cells) // 2}, 1\n*ELSET, ELSET=both\nhalf, {len(mesh.cells)}\n"
    for face in range(1, n_face + 1):
        text += f"*SURFACE, NAME=side{face}, TYPE=ELEMENT\nSOLID, S{face}\n"
    text += "*NSET, NSET=Some\n1, 2\n*SURFACE, NAME=spots, TYPE=NODE\nsome\n*STEP\n*STATIC\n1., 1.\n*END STEP\n"
    path = tmp_path / "model.inp"
    path.write_text(text)
    content = open_mesh_file(path)
    assert {name: len(rows[element]) for name, rows in content.groups.items()} == {
        "solid": len(mesh.cells),
        "Half": len(mesh.cells) // 2,
        "both": len(mesh.cells) // 2 + 1,
    }
    read = read_mesh(path)
    # Every face of every cell has exactly one label: together they are all faces.
    labelled = np.concatenate([np.sort(part, axis=1) for f in range(n_face) for part in content.facets[f"side{f + 1}"]])
    n_corner = labelled.shape[1]
    every = np.sort(mesh.facets()[:, :n_corner], axis=1)
    np.testing.assert_array_equal(labelled[np.lexsort(labelled.T)], every[np.lexsort(every.T)])
    assert sorted(read.nodes("spots").tolist()) == [0, 1]
    if element == "hex20":
        # Abaqus: S1 is 1-2-3-4 (z_min in this block), S2 5-8-7-6, S3 1-5-6-2, S4 2-6-7-3, S5 3-7-8-4, S6 4-8-5-1.
        sides = ["z_min", "z_max", "y_min", "x_max", "y_max", "x_min"]
        for face, side in enumerate(sides, start=1):
            chosen = {tuple(sorted(row)) for row in read.surface(f"side{face}").tolist()}
            assert {tuple(sorted(row)) for row in mesh.surface(side).tolist()} <= chosen


def test_linear_cells_are_refused_or_raised(tmp_path: Path) -> None:
    for kind, cells, element in (("tetra", [[0, 1, 3, 4]], "tet10"), ("hexahedron", [list(range(8))], "hex20")):
        corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
        marked = (corner[:, 2] == 0).astype(np.int64)
        path = tmp_path / f"{kind}.vtu"
        meshio.write(path, meshio.Mesh(corner, [(kind, np.array(cells))], point_data={"low": marked}))
        with pytest.raises(FemInputError, match=r"lock in bending; .*raise_order"):
            read_mesh(path)
        mesh = read_mesh(path, raise_order=True)
        assert mesh.element == element
        assert _volume(mesh) == pytest.approx(1.0 if element == "hex20" else 1.0 / 6.0)
        assert _area(mesh, "low") == pytest.approx(1.0 if element == "hex20" else 0.5)


def test_several_bodies_share_a_file_and_a_face(tmp_path: Path) -> None:
    """Two groups with a common face: each body gets its own nodes, and the face faces outward in both."""
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1))
    left = (mesh.points[mesh.cells].mean(axis=1)[:, 0] < 1.0).astype(np.int64)
    x = mesh.points[mesh.facets()][:, :, 0]
    face = mesh.facets()[np.all(x == 1.0, axis=1)][:1]
    blocks = [("hexahedron20", mesh.cells), ("quad8", face)]
    tags = [2 - left, np.array([7])]
    path = tmp_path / "two.msh"
    names = {"left": np.array([1, 3]), "right": np.array([2, 3]), "joint": np.array([7, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(mesh.points, blocks, cell_data=data, field_data=names), file_format="gmsh22")
    for name, direction in (("left", 1.0), ("right", -1.0)):
        body = read_mesh(path, group=name)
        assert len(body.points) == 20
        normals = surface_points(body.points, body.surface("joint")).normals
        np.testing.assert_allclose(normals[:, 0], direction, atol=1e-12)
    with pytest.raises(FemInputError, match="groups of cells in the file: left, right"):
        read_mesh(path, group="middle")


def _bad(tmp_path: Path, name: str, text: str) -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.stl", "solid", "unknown kind of mesh file"),
        ("a.msh", "nonsense", "cannot read the mesh file"),
        ("a.vtu", "<nonsense", "cannot read the mesh file"),
        ("a.inp", "*NODE\n1, 0, 0, 0\n", "no solid cells"),
        ("a.inp", "*NODE\n1, 0, zero, 0\n", r"a.inp, \*NODE: cannot read these lines"),
        ("a.inp", "*ELEMENT, TYPE=C3D10\n1, 1, 2, 3\n", "C3D10 needs 11 numbers"),
        ("a.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n", "missing node; got 2"),
        ("a.inp", "*ELEMENT, TYPE=C3D15\n1, 1\n", "unsupported solid element C3D15"),
        ("a.inp", "*NGEN\n1, 5, 1\n", "generated nodes"),
        ("a.inp", "*INSTANCE, NAME=a, PART=p\n1., 0., 0.\n", "without parts and instances"),
        ("a.inp", "*INCLUDE, INPUT=other.inp\n", "no such file to include"),
        ("a.inp", "*NSET, NSET=a\nb\n", "cannot read these lines"),
    ],
)
def test_files_that_cannot_be_read_are_named(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        open_mesh_file(_bad(tmp_path, name, text))


def test_missing_file_and_wrong_node_order_are_named(tmp_path: Path) -> None:
    with pytest.raises(FemInputError, match="no such mesh file"):
        read_mesh(tmp_path / "none.msh")
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1))
    swapped = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
    with pytest.raises(FemInputError, match="middle node is far"):
        read_mesh(_bad(tmp_path, "swapped.inp", _inp(mesh, swapped, "C3D20")))
    turned = [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]
    with pytest.raises(FemInputError, match="inverted cell"):
        single(read_mesh(_bad(tmp_path, "inverted.inp", _inp(mesh, turned, "C3D20"))))


_GEO = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 3, 2, 1};
Physical Volume("block") = {1};
Physical Surface("left") = {1};
"""


@pytest.mark.skipif(importlib.util.find_spec("gmsh") is not None, reason="Gmsh is installed")
def test_geometry_without_gmsh_says_what_to_install(tmp_path: Path) -> None:
    with pytest.raises(FemInputError, match=r"romgen\[mesh\]"):
        read_mesh(_bad(tmp_path, "box.geo", _GEO))


@pytest.mark.skipif(importlib.util.find_spec("gmsh") is None, reason="needs Gmsh")
def test_geometry_is_meshed_with_tet10(tmp_path: Path) -> None:
    mesh = read_mesh(_bad(tmp_path, "box.geo", _GEO), mesh_size=1.0, unit=1e-3)
    assert mesh.element == "tet10"
    assert _volume(mesh) == pytest.approx(6e-9, rel=1e-9)
    assert _area(mesh, "left") == pytest.approx(2e-6, rel=1e-9)
    with pytest.raises(FemInputError, match="Gmsh cannot"):
        read_mesh(_bad(tmp_path, "bad.geo", "Box(1) = {"))
