"""Studies with bodies from files: names, units, mixed elements, loads and constraints from tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from typer.testing import CliRunner

from fem.block import graded, hex_block
from romgen import fe_stages
from romgen.cli.app import app
from romgen.errors import InputError
from romgen.fe_inputs import still, time_loads
from romgen.report.vtu import write_vtu
from romgen.settings import Study, load_study
from romgen.stage import table_content
from tests.toml_text import toml_text


def _panel_file(path: Path) -> None:
    """A strip of TET10 in mm: physical volume "strip", surfaces "end" (x = 100) and "low" (y = 0)."""
    lines = [graded([0.0, 100.0], [5]), graded([0.0, 4.0], [1]), graded([0.0, 20.0], [2])]
    mesh = hex_block(*lines, element="tet10")
    end, low = mesh.surface("x_max"), mesh.surface("y_min")
    tags = [np.full(len(mesh.cells), 1), np.full(len(end), 2), np.full(len(low), 3)]
    names = {"strip": np.array([1, 3]), "end": np.array([2, 2]), "low": np.array([3, 2])}
    blocks = [("tetra10", mesh.cells), ("triangle6", end), ("triangle6", low)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(mesh.points, blocks, cell_data=data, field_data=names), file_format="gmsh22")


@pytest.fixture
def tables(tmp_path: Path) -> dict[str, Any]:
    """A cantilever strip from a file on a block that it is clamped to, gravity and a moved tip."""
    _panel_file(tmp_path / "strip.msh")
    return {
        "study": {"name": "strip"},
        "materials": {"steel": {"young_modulus": 200e9, "poisson_ratio": 0.3, "density": 7800.0}},
        "meshes": {"strip": {"file": "strip.msh", "unit": "mm", "material": "steel", "group": "strip"}},
        "blocks": {
            "base": {"material": "steel", "x": [0.0, 0.02], "cells_x": [1], "y": [-0.01, 0.0], "cells_y": [1]}
            | {"z": [0.0, 0.02], "cells_z": [1]}
        },
        "regions": {"root": {"body": "strip", "x": [0.0, 0.0]}},
        "constraints": [
            {"surface": "strip.root", "directions": ["x", "y", "z"]},
            {"surface": "base.y_min", "directions": ["x", "y", "z"]},
            {"surface": "strip.end", "directions": ["y"], "displacement": ["0.1 mm"]},
        ],
        "loads": [{"name": "gravity", "acceleration": [0.0, -9.81, 0.0]}],
        "sensors": {"tip": {"point": [0.1, 0.002, 0.01], "direction": "y"}},
        "ringdowns": {"time_step": 1e-4, "duration": 0.01, "training": [{"name": "a", "amplitudes": [1e-4]}]},
        "learn": {"master_modes": [1]},
        "modes": {"count": 2},
    }


def _study(folder: Path, tables: dict[str, Any]) -> Study:
    path = folder / "study.toml"
    path.write_text(toml_text(tables))
    return load_study(path)


def test_body_from_a_file_has_its_unit_material_and_names(tmp_path: Path, tables: dict[str, Any]) -> None:
    model = fe_stages.build(_study(tmp_path, tables))
    strip = next(body for body in model.bodies if body.name == "strip")
    assert np.ptp(strip.mesh.points, axis=0) == pytest.approx([0.1, 0.004, 0.02], rel=1e-12)
    assert set(strip.mesh.surfaces) == {"end", "low", "root"}
    volume = 0.1 * 0.004 * 0.02 + 0.02 * 0.01 * 0.02
    assert model.load.reshape(-1, 3).sum(axis=0) == pytest.approx([0.0, -9.81 * 7800.0 * volume, 0.0], abs=1e-9)
    assert model.prescribed.max() == pytest.approx(1e-4)


def test_tip_moves_as_told_and_stress_is_that_of_a_beam(tmp_path: Path, tables: dict[str, Any]) -> None:
    """sigma = 3 E (h/2) delta/L^2 (1 - x/L) = 9.6 MPa at x = L/5; gravity adds 0.4 MPa, coarse TET10 the rest: 15 %."""
    study = _study(tmp_path, tables)
    preload = fe_stages.solve_preload(study, lambda share, text: None)
    model = fe_stages.build(study)
    end = model.facets("strip.end")
    np.testing.assert_allclose(preload.displacement.reshape(-1, 3)[np.unique(end), 1], 1e-4, rtol=1e-12)
    near_root = (np.abs(model.points[:, 0] - 0.02) < 1e-9) & (np.abs(model.points[:, 1] - 0.004) < 1e-9)
    bending = 3.0 * 200e9 * 0.002 * 1e-4 / 0.1**2 * 0.8
    assert preload.stress[near_root, 0].mean() == pytest.approx(-bending, rel=0.15)
    modes = fe_stages.solve_modes(study, preload)
    assert modes.total_mass == pytest.approx(7800.0 * (8e-6 + 4e-6), rel=1e-9)
    assert np.all(modes.effective_mass.sum(axis=0) < modes.total_mass)


def test_mixed_elements_are_written_and_read_back(tmp_path: Path, tables: dict[str, Any]) -> None:
    structure = fe_stages.structure(_study(tmp_path, tables))
    assert structure.cell_types == ("hex20", "tet10")
    write_vtu(tmp_path / "mesh.vtu", structure, {})
    read = meshio.read(tmp_path / "mesh.vtu")
    assert [(block.type, len(block.data)) for block in read.cells] == [("hexahedron20", 1), ("tetra10", 60)]
    np.testing.assert_array_equal(read.cells[1].data, structure.cells[1:, :10])
    assert structure.skin.min() >= 0


def test_key_of_the_mesh_stage_follows_the_content_of_the_file(tmp_path: Path, tables: dict[str, Any]) -> None:
    study = _study(tmp_path, tables)
    before = table_content(study, "meshes")
    (tmp_path / "strip.msh").write_bytes((tmp_path / "strip.msh").read_bytes() + b"\n")
    assert table_content(study, "meshes") != before


@pytest.mark.parametrize(
    ("table", "key", "value", "message"),
    [
        ("constraints", "surface", "strip.rot", "[constraints[0]] surface: unknown surface 'strip.rot'; did you mean"),
        ("meshes", "group", "plate", "[meshes.strip] strip.msh: unknown group; got plate; groups of cells"),
        ("meshes", "file", "study.toml", "unknown kind of mesh file"),
        ("regions", "x", [5.0, 6.0], "region root: no node lies in the region"),
        ("contacts", "slave", "strip.lo", "[contacts.pad] slave: unknown surface 'strip.lo'; did you mean"),
        (
            "point_masses",
            "point",
            [0.01, 0.0, 0.01],
            "[point_masses.tip]: the point lies on several bodies; got (0.01, 0.0, 0.01)",
        ),
        ("sensors", "point", [0.3, 0.0, 0.01], "[sensors.tip]: the point lies outside all bodies"),
    ],
)
def test_check_opens_mesh_files(
    tmp_path: Path, tables: dict[str, Any], table: str, key: str, value: Any, message: str
) -> None:
    tables["contacts"] = {"pad": {"slave": "strip.low", "master": "base.y_max", "friction": 0.3}}
    tables["point_masses"] = {"tip": {"point": [0.01, 0.0, 0.01], "body": "strip", "mass": 1.0}}
    if table == "point_masses":
        del tables["point_masses"]["tip"]["body"]
    names = {"meshes": "strip", "regions": "root", "contacts": "pad", "sensors": "tip", "point_masses": "tip"}
    entry = tables[table][0] if table == "constraints" else tables[table][names[table]]
    entry[key] = value
    (tmp_path / "study.toml").write_text(toml_text(tables))
    result = CliRunner().invoke(app, ["check", str(tmp_path / "study.toml")])
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_named_body_takes_the_point(tmp_path: Path, tables: dict[str, Any]) -> None:
    """Sensor, force, excitation, spring and mass at a point that strip and base share act on the one that is named."""
    point = [0.01, 0.0, 0.01]
    tables["sensors"]["tip"] |= {"point": point, "body": "strip"}
    tables["loads"] = [{"name": "f", "point": point, "body": "base", "force": [0.0, 1.0, 0.0]}]
    tables["excitations"] = {"shaker": {"point": point, "body": "strip", "direction": [0.0, 1.0, 0.0]}}
    tables["springs"] = {"s": {"point": point, "body": "strip", "to": point, "to_body": "base", "stiffness": [1, 1, 1]}}
    tables["point_masses"] = {"m": {"point": point, "body": "base", "mass": 1.0}}
    study = _study(tmp_path, tables)
    model = fe_stages.build(study)
    names = [body.name for body in model.bodies]
    ends = [*model.offsets[1:], len(model.points)]
    parts = {n: slice(3 * int(a), 3 * int(b)) for n, a, b in zip(names, model.offsets, ends, strict=True)}
    assert model.load[parts["base"]].sum() == pytest.approx(1.0, abs=1e-12)
    (shaker,) = time_loads(study, model, {"shaker": still})
    assert shaker.pattern[parts["strip"]].sum() == pytest.approx(1.0, abs=1e-12)
    assert model.springs.operator[:, parts["strip"]].sum() == pytest.approx(3.0, abs=1e-12)
    assert model.springs.operator[:, parts["base"]].sum() == pytest.approx(-3.0, abs=1e-12)
    sensors = [fe_stages.Sensor(name, s.point, s.direction, s.body) for name, s in study.sensors.items()]
    assert fe_stages.sensor_rows(model, sensors)[0, parts["strip"]].sum() == pytest.approx(1.0, abs=1e-12)
    result = CliRunner().invoke(app, ["check", str(tmp_path / "study.toml")])
    assert result.exit_code == 0


def test_ties_that_bond_little_are_logged_once(
    tmp_path: Path, tables: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    """A strip of 100 mm covers its base of 20 mm: no word. Moved off all but a quarter: one line."""
    tables["ties"] = {"pad": {"slave": "strip.low", "master": "base.y_max"}}
    fe_stages.solve_preload(_study(tmp_path, tables), lambda share, text: None)
    assert "bonded" not in caplog.text
    tables["blocks"]["base"]["x"] = [-0.015, 0.005]
    study = _study(tmp_path, tables)
    fe_stages.build(study)
    assert "bonded" not in caplog.text
    fe_stages.solve_preload(study, lambda share, text: None)
    lines = [line for line in caplog.messages if "bonded" in line]
    assert len(lines) == 1
    assert lines[0].startswith("tie pad: only 5 % of the slave strip.low (25 % of the area of base.y_max)")


def test_check_counts_the_nodes_of_files(tmp_path: Path, tables: dict[str, Any]) -> None:
    study = _study(tmp_path, tables)
    result = CliRunner().invoke(app, ["check", str(tmp_path / "study.toml")])
    assert result.exit_code == 0
    assert f"{fe_stages.build(study).n_dof} displacement unknowns" in result.stdout
    assert "1 blocks, 1 mesh files" in result.stdout


def test_loads_of_every_kind(tmp_path: Path, tables: dict[str, Any]) -> None:
    tables["loads"] = [
        {"name": "a", "surface": "strip.end", "force": ["2 N", 0.0, 0.0]},
        {"name": "b", "surface": "strip.end", "traction": ["1 MPa", 0.0, 0.0]},
        {"name": "c", "point": [0.05, 0.002, 0.01], "force": [0.0, 0.0, 3.0]},
        {"name": "d", "surface": "strip.low", "total_force": 4.0},
        {"name": "e", "surface": "strip.low", "pressure": "1 kPa"},
    ]
    sums = fe_stages.build(_study(tmp_path, tables)).loads.reshape(5, -1, 3).sum(axis=1)
    np.testing.assert_allclose(sums, [[2, 0, 0], [80, 0, 0], [0, 0, 3], [0, 4, 0], [0, 2, 0]], atol=1e-9)


def test_unknown_names_stop_a_run_in_one_line(tmp_path: Path, tables: dict[str, Any]) -> None:
    tables["constraints"][0]["surface"] = "strip.rot"
    with pytest.raises(InputError, match=r"unknown surface or node set; got rot; known surfaces: end, low, root"):
        fe_stages.build(_study(tmp_path, tables))
