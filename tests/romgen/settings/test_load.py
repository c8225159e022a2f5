"""Every mistake in a study file is one clear line, and all of them are shown at once."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from romgen.errors import InputError
from romgen.settings import StudyError, load_study
from romgen.settings.checks import study_problems
from romgen.settings.load import _extended, _read_toml, _validated, known_keys
from tests.toml_text import toml_text

ROOT = Path(__file__).parents[3]


def problems(folder: Path, tables: dict[str, Any]) -> tuple[str, ...]:
    path = folder / "study.toml"
    path.write_text(toml_text(tables), encoding="utf-8")
    with pytest.raises(StudyError) as caught:
        load_study(path)
    assert caught.value.exit_code == 2
    return caught.value.problems


def test_valid_study_loads(tmp_path: Path, tables: dict[str, Any]) -> None:
    path = tmp_path / "study.toml"
    path.write_text(toml_text(tables), encoding="utf-8")
    study = load_study(path)
    assert study.name == "small"
    assert study.ringdowns is not None
    assert study.ringdowns.steps == 1000
    assert study.sensor_names == ("tip",)


SHIPPED = [path for path in sorted((ROOT / "models").glob("*/*.toml")) if "study" in _read_toml(path)]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_shipped_studies_have_no_problem_but_absent_data(path: Path) -> None:
    study, found = _validated(_extended(_read_toml(path), path), path)
    assert found == []
    assert study is not None
    assert [line for line in study_problems(study) if "no such file" not in line] == []


def _set(*keys: str | int, to: Any) -> Callable[[dict[str, Any]], None]:
    def edit(tables: dict[str, Any]) -> None:
        target: Any = tables
        for key in keys[:-1]:
            target = target[key]
        target[keys[-1]] = to

    return edit


def _without(*keys: str) -> Callable[[dict[str, Any]], None]:
    def edit(tables: dict[str, Any]) -> None:
        target: Any = tables
        for key in keys[:-1]:
            target = target[key]
        del target[keys[-1]]

    return edit


MISTAKES: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (_set("learn", to={"method": "best"}), "[learn] method: Input should be 'auto', 'direct' or 'refined'; got 'best'"),
    (_set("lern", to={}), "unknown key 'lern'; did you mean 'learn'?"),
    (_set("blocks", "bar", "matrial", to="steel"), "[blocks.bar] unknown key 'matrial'; did you mean 'material'?"),
    (_set("ringdowns", "training", 0, "amplitude", to=[1.0]), "[ringdowns.training[0]] unknown key 'amplitude'; did"),
    (_set("blocks", "bar", "arch", to={"rize": 1.0, "span": 1.0}), "[blocks.bar.arch] missing key 'rise'"),
    (_set("preload", to={"xyzzy": 1}), "known keys are steps, tolerance, max_iterations"),
    (_without("materials", "steel", "density"), "[materials.steel] missing key 'density'"),
    (_set("materials", "steel", "poisson_ratio", to=0.5), "poisson_ratio: Input should be less than 0.5; got 0.5"),
    (_set("materials", "steel", "young_modulus", to="210 GN"), "young_modulus: unknown unit 'GN', accepted are Pa"),
    (_set("materials", "steel", "density", to=-1.0), "[materials.steel] density: Input should be greater than 0"),
    (_set("materials", "steel", "density", to=float("inf")), "density: Input should be a finite number"),
    (
        _set("materials", "steel", "density", to=True),
        "[materials.steel] density: true and false are no numbers; got True",
    ),
    (_set("forced_response", "levels", to=[1.0, True]), "[forced_response] levels: true and false are no numbers"),
    (_set("forced_response", "levels", to=[1.0, 0.0]), "[forced_response] levels must not be 0; got [1.0, 0.0]"),
    (_set("forced_response", "frequency_range_hz", to=[115.0, 105.0]), "frequency_range_hz must rise; got [115, 105]"),
    (_set("study", "name", to="two words"), "[study] name:"),
    (_set("blocks", "bar", "material", to="stel"), "unknown material 'stel'; did you mean 'steel'?"),
    (_set("blocks", "bar", "cells_x", to=[2, 2]), "[blocks.bar] x has 1 intervals but cells_x has 2 numbers"),
    (_set("blocks", "bar", "cells_x", to=[0]), "[blocks.bar] cells_x must be positive"),
    (_set("blocks", "bar", "x", to=[1.0, 0.0]), "[blocks.bar] breakpoints x must increase"),
    (_set("blocks", "bar", "element", to="hex8"), "[blocks.bar] element: Input should be 'hex20'"),
    (_set("contacts", "joint", "slave", to="bar.y_mni"), "unknown surface 'bar.y_mni'; did you mean 'bar.y_min'?"),
    (_set("contacts", "joint", "master", to="bar.y_max"), "slave and master belong to the same block"),
    (_set("contacts", "joint", "friction", to=-0.1), "friction: Input should be greater than or equal to 0"),
    (_set("constraints", 0, "surface", to="floor"), "[constraints[0]] surface: unknown surface 'floor'; known are"),
    (_set("constraints", 0, "directions", to=["w"]), "Input should be 'x', 'y', 'z' or 'normal'; got 'w'"),
    (_set("loads", 0, "surface", to="bar.y_mx"), "[loads[0]] surface: unknown surface 'bar.y_mx'"),
    (_set("loads", 0, "surface", to="bar.y_max&z_mn"), "[loads[0]] surface: unknown surface 'bar.z_mn'; did you mean"),
    (
        _set("loads", 0, "force", to=[1.0, 0.0, 0.0]),
        "needs one of total_force, pressure, force, traction, acceleration",
    ),
    (_set("loads", 0, to={"name": "g", "acceleration": [0, 0, -9.81], "surface": "bar.y_max"}), "goes with no place"),
    (_set("loads", 0, to={"name": "f", "force": [0, 0, 1.0]}), "force goes with surface or point; got none"),
    (_set("constraints", 0, "displacement", to=[1e-3, 0.0]), "displacement needs one value for each of"),
    (_set("contacts", "joint", "slave", to="bar.y_min&x_min"), "unknown surface 'bar.y_min&x_min'"),
    (_set("meshes", to={"m": {"file": "gone.msh", "material": "stel"}}), "unknown material 'stel'"),
    (_set("meshes", to={"m": {"file": "gone.msh", "material": "steel"}}), "[meshes.m] file: no such file"),
    (_set("meshes", to={"bar": {"file": "a.msh", "material": "steel"}}), "a block and a mesh of the same name: bar"),
    (_set("meshes", to={"m": {"file": "a.msh", "material": "steel", "unit": "ft"}}), "[meshes.m] unit: Input should"),
    (_set("regions", to={"pad": {"body": "bra", "x": [0, 1]}}), "unknown body 'bra'; did you mean 'bar'?"),
    (_set("regions", to={"pad": {"body": "bar"}}), "needs a range for at least one of x, y, z"),
    (_set("regions", to={"pad": {"body": "bar", "x": [1, 0]}}), "ranges must go from the smaller to the larger"),
    (_set("sensors", "tip", "point", to=[1.0, 5.0, 0.1]), "[sensors.tip] point lies in no block"),
    (_set("sensors", to={}), "[sensors] is empty"),
    (_set("sensors", "tip", "body", to="bra"), "[sensors.tip] body: unknown body 'bra'; did you mean 'bar'?"),
    (_set("sensors", "tip", "body", to="base"), "[sensors.tip] point lies in no part of block base"),
    (_set("loads", 0, "body", to="bar"), "body goes with a point; the name of a surface holds its body"),
    (
        _set("loads", 0, to={"name": "f", "force": [0, 0, 1.0], "point": [0.5, 0, 0]}),
        '[loads[0]] point lies on bar and base, which move apart; add body = "bar" or another; got [0.5, 0.0, 0.0]',
    ),
    (_set("point_masses", to={"m": {"point": [0.5, 0.0, 0.0], "mass": 1.0}}), "[point_masses.m] point lies on bar and"),
    (
        _set("springs", to={"s": {"point": [0.5, 0, 0], "body": "bar", "to": [0.5, 0, 0], "stiffness": [1, 1, 1]}}),
        "[springs.s] to: point lies on bar and base, which move apart; add to_body",
    ),
    (
        _set("excitations", to={"f": {"point": [0.5, 0, 0], "direction": [0, 1, 0]}}),
        "[excitations.f] point lies on bar",
    ),
    (_set("excitations", to={"p": {"surface": "bar.y_max", "body": "bar"}}), "body goes with a point; the name of"),
    (_set("modes", to={"count": 1}), "[learn] master_modes are numbered from 1 to count = 1"),
    (_set("ringdowns", "validation", 0, "amplitudes", to=[2e-3, 0.0]), "'b' is a multiple of training 'a'"),
    (_set("ringdowns", "validation", 0, "name", to="a"), "[ringdowns] names of starts must differ"),
    (_set("ringdowns", "training", 0, "amplitudes", to=[1e-3]), "start 'a' needs one amplitude per master mode (2)"),
    (_set("ringdowns", "training", 0, "amplitudes", to=[0.0, 0.0]), "start 'a' has only zero amplitudes"),
    (_set("ringdowns", "time_step", to=0.0), "[ringdowns] time_step: Input should be greater than 0"),
    (_set("learn", to={"order": 11}), "[learn] order must be 2 to 9"),
    (_set("learn", to={"order": 1}), "[learn] order must be 2 to 9 or 'auto'; got 1"),
    (_set("learn", to={"internal_resonance": [1, 2, 3]}), "needs one integer per master mode"),
    (_set("learn", to={"internal_resonance": "always"}), "[learn] internal_resonance:"),
    (_set("learn", to={"master_modes": [1, 1]}), "[learn] master_modes must differ"),
    (_set("learn", to={"master_modes": [0]}), "[learn] master_modes are numbers from 1; got [0]"),
    (_set("forced_response", "sensor", to="tpi"), "unknown sensor 'tpi'; did you mean 'tip'?"),
    (_set("forced_response", "input", to="shaker"), "unknown load input 'shaker'"),
    (_set("forced_response", "measure", to="rms"), "Input should be 'max' or 'sqrt2_rms'; got 'rms'"),
    (_set("fmu", to={"sensors": ["top"]}), "[fmu] sensors: unknown sensor 'top'; did you mean 'tip'?"),
    (_set("fmu", to={"platforms": ["linux"]}), "[fmu] platforms: unknown platform 'linux'; did you mean 'linux64'?"),
    (_set("fmu", to={"step_size": "1 h"}), "[fmu] step_size: unknown unit 'h'"),
    (_set("fmu", to={"input_range": {"shaker": [-1, 1]}}), "[fmu] input_range: unknown load input 'shaker'"),
    (_set("fmu", to={"input_range": {"base_acceleration": ["1 g", "2 g"]}}), "must hold 0 and more; got [9.80665, 19"),
    (_set("fmu", to={"input_range": {"base_acceleration": ["-1 G", 1]}}), "unknown unit 'G', accepted are m/s^2"),
    (_set("fmu", to={"icon": "gone.png"}), "[fmu] icon: no such file"),
    (_set("fmu", to={"icon": "study.toml"}), "[fmu] icon: importers show PNG images only"),
    (_set("data", to={"files": ["a.mat"], "sensors": ["a"], "training": [0]}), "both [data] and a finite-element"),
    (_without("ringdowns"), "has [blocks] or [meshes] but no [ringdowns]"),
    (_set("forcing", to={"shaker": {"participation": {"tip": [1.0, 0.0]}}}), "has [forcing] but no [data]"),
    (_set("blocks", to={}), "has neither [data] nor [blocks.<name>]"),
]


@pytest.mark.parametrize(("edit", "expected"), MISTAKES, ids=[expected[:40] for _, expected in MISTAKES])
def test_mistake_is_one_line(
    tmp_path: Path, tables: dict[str, Any], edit: Callable[[dict[str, Any]], None], expected: str
) -> None:
    edit(tables)
    found = problems(tmp_path, tables)
    assert any(expected in line for line in found), found
    assert all("\n" not in line and line.startswith("study.toml: ") for line in found)
    assert not any("pydantic" in line or "Value error" in line for line in found)


PEAK = {"level": 2.0, "sensor": "mid", "amplitude": 1e-3}
FORCING_MISTAKES: list[tuple[str, dict[str, Any], str]] = [
    ("shaker", {}, "[forcing.shaker] needs either points (measured) or participation (known)"),
    ("shaker", {"points": [PEAK], "participation": {"mid": [1, 0]}}, "needs either points (measured) or participation"),
    ("shaker", {"points": [PEAK], "sing": 1}, "[forcing.shaker] unknown key 'sing'; did you mean 'sign'?"),
    (
        "shaker",
        {"points": [{**PEAK, "level": 0.0}]},
        "[forcing.shaker.points[0]] level: Input should be greater",
    ),
    ("shaker", {"points": [{**PEAK, "amplitude": -1.0}]}, "amplitude: Input should be greater than 0; got -1.0"),
    (
        "shaker",
        {"points": [{**PEAK, "amplitude": "1 furlong"}]},
        "amplitude: unknown unit 'furlong', accepted are m",
    ),
    ("shaker", {"points": [{**PEAK, "frequency_hz": 0.0}]}, "frequency_hz: Input should be greater than 0"),
    ("shaker", {"points": [{**PEAK, "measure": "rms"}]}, "measure: Input should be 'max' or 'sqrt2_rms'; got 'rms'"),
    ("shaker", {"points": [{"level": 2.0, "sensor": "mid"}]}, "[forcing.shaker.points[0]] missing key 'amplitude'"),
    ("shaker", {"points": [{**PEAK, "sensor": "mit"}]}, "sensor of point 1: unknown sensor 'mit'; did you mean 'mid'?"),
    ("shaker", {"points": [{**PEAK, "mode": 3}]}, "mode of point 1: [learn] master_modes has 2 modes; got 3"),
    (
        "shaker",
        {"points": [{**PEAK, "mode": 1, "frequency_hz": 9.0}]},
        "mode says whose peak a point without",
    ),
    ("shaker", {"points": [PEAK], "modes": [1, 2]}, "needs at least one point per loaded mode; got 1 for 2"),
    ("shaker", {"points": [PEAK, PEAK], "modes": [1, 1]}, "modes must differ; got [1, 1]"),
    ("shaker", {"points": [PEAK], "modes": [3]}, "modes are numbered from 1 to the 2 of [learn] master_modes; got [3]"),
    ("shaker", {"points": [PEAK], "sign": 2}, "sign: Input should be -1 or 1; got 2"),
    ("shaker", {"participation": {"mid": [1.0]}}, "participation of mid: one number per master mode (2); got 1"),
    ("shaker", {"participation": {"top": [1.0, 0.0]}}, "participation: unknown sensor 'top'; known are lower, mid"),
    (
        "shaker",
        {"participation": {"mid": [0, 0]}},
        "participation is zero for all modes",
    ),
    ("shaker", {"participation": {"mid": [1, 0]}, "modes": [1]}, "modes and sign go with points"),
    ("mid", {"points": [PEAK]}, "[forcing.mid] the name is taken by a sensor; choose another"),
    ("sha ker", {"points": [PEAK]}, "the name becomes a variable of the FMU: letters, digits and underscores; got"),
]


@pytest.mark.parametrize(
    ("name", "table", "expected"), FORCING_MISTAKES, ids=[line[:40] for *_, line in FORCING_MISTAKES]
)
def test_mistake_in_a_load_of_data_is_one_line(tmp_path: Path, name: str, table: dict[str, Any], expected: str) -> None:
    (tmp_path / "a.mat").write_bytes(b"x")
    data = {"files": ["a.mat"], "sensors": ["lower", "mid"], "training": [0]}
    found = problems(tmp_path, {"study": {"name": "lab"}, "data": data, "forcing": {name: table}})
    assert len(found) == 1, found
    assert expected in found[0]
    assert "\n" not in found[0]


def test_levels_without_a_load_say_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(b"x")
    data = {"files": ["a.mat"], "sensors": ["mid"], "training": [0]}
    found = problems(tmp_path, {"study": {"name": "lab"}, "data": data, "forced_response": {"levels": [1.0]}})
    assert len(found) == 1
    assert (
        "[forced_response] levels need a load input, which data do not have; add [forcing.base_acceleration]"
        in found[0]
    )


def test_loads_of_data_are_inputs(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(b"x")
    data = {"files": ["a.mat"], "sensors": ["lower", "mid"], "training": [0]}
    forcing = {"base_acceleration": {"points": [{**PEAK, "amplitude": "0.62 mm"}]}, "hammer": {"points": [PEAK]}}
    path = tmp_path / "study.toml"
    path.write_text(toml_text({"study": {"name": "lab"}, "data": data, "forcing": forcing}), encoding="utf-8")
    study = load_study(path)
    assert study.load_inputs == {"base_acceleration": "m/s2", "hammer": "N"}
    assert study.forcing["base_acceleration"].points[0].amplitude == pytest.approx(0.62e-3)


def test_all_problems_are_listed(tmp_path: Path, tables: dict[str, Any]) -> None:
    tables["lern"] = {}
    tables["preload"] = {"step": 1}
    tables["contacts"]["joint"]["master"] = "bse.y_max"
    tables["forced_response"]["sensor"] = "tpi"
    assert len(problems(tmp_path, tables)) == 4


def test_missing_data_file_and_overlap(tmp_path: Path) -> None:
    data = {"files": ["gone.mat"], "sensors": ["a", "a"], "training": [0, 1], "validation": [1]}
    found = problems(tmp_path, {"study": {"name": "lab"}, "data": data})
    assert len(found) == 3
    assert f"no such file; got '{tmp_path / 'gone.mat'}'" in found[0]
    assert "validation overlaps training; got 1 in both" in found[1]


def test_files_are_relative_to_the_study(tmp_path: Path) -> None:
    (tmp_path / "sub folder ü").mkdir()
    (tmp_path / "sub folder ü" / "a.mat").write_bytes(b"x")
    path = tmp_path / "sub folder ü" / "study.toml"
    path.write_text(
        toml_text({"study": {"name": "lab"}, "data": {"files": ["a.mat"], "sensors": ["a"], "training": ["one"]}}),
        encoding="utf-8",
    )
    data = load_study(path).data
    assert data is not None
    assert data.files == ((tmp_path / "sub folder ü" / "a.mat").resolve(),)


def test_not_toml_and_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such study file"):
        load_study(tmp_path / "study.toml")
    (tmp_path / "study.toml").write_text("a = = 1", encoding="utf-8")
    with pytest.raises(InputError, match="not valid TOML"):
        load_study(tmp_path / "study.toml")


def test_extended_study_keeps_what_it_does_not_change(tmp_path: Path, tables: dict[str, Any]) -> None:
    (tmp_path / "base.toml").write_text(toml_text(tables), encoding="utf-8")
    variant = {"study": {"name": "variant", "extends": "base.toml"}, "ringdowns": {"duration": 0.05}}
    (tmp_path / "variant.toml").write_text(toml_text(variant), encoding="utf-8")
    base, changed = load_study(tmp_path / "base.toml"), load_study(tmp_path / "variant.toml")
    assert changed.ringdowns is not None
    assert base.ringdowns is not None
    assert changed.ringdowns.steps == 500
    assert changed.ringdowns.starts == base.ringdowns.starts
    assert changed.blocks == base.blocks


def test_circle_of_extended_studies(tmp_path: Path) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        text = toml_text({"study": {"name": name, "extends": f"{other}.toml"}})
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="goes round in a circle"):
        load_study(tmp_path / "a.toml")


def test_known_keys_follow_the_path() -> None:
    assert known_keys(("blocks", "any", "arch")) == ("rise", "span")
    assert known_keys(("ringdowns", "training", 0)) == ("name", "amplitudes")
    assert known_keys(("materials",)) == ()
