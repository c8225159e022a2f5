"""The validation levels pass for exported units, and miss what is wrong."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from romgen.errors import InputError, RomgenError
from romgen.fmu.archive import write_archive
from romgen.fmu.compilers import host_platform
from romgen.fmu.export import export_fmu
from romgen.fmu.export3 import export_fmi3
from romgen.fmu.levels import validate_unit
from romgen.fmu.model_file import model_from_json, model_json
from romgen.fmu.records import FmuExport, FmuInfo, LevelRow
from romgen.fmu.unit_facts import unit_facts
from romgen.polynomial import evaluate, zeta
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from romgen.stability import tried_stability
from tests.romgen.fmu.damage import damaged
from tests.romgen.fmu.models import duffing_chain, random_model, random_states


@pytest.mark.parametrize("make", [lambda: random_model(5, 2), lambda: random_model(3, 0), lambda: duffing_chain(3)])
def test_exported_units_pass_every_level(make, tmp_path: Path) -> None:
    export = export_fmu(make(), tmp_path / "x.fmu", FmuSettings())
    levels = validate_unit(Path(export.path))
    host = {"newest GNU C library asked for, 2.04 for version 2.4"} if export.compiler != "zig" else set()
    assert [r.check for r in levels.rows if not r.passed and r.check not in host] == []
    assert {r.level for r in levels.rows} >= {"L0", "L1", "L2"}


ALL = pytest.mark.slow
KINDS = [
    ("3.0", "file", "host"),
    pytest.param("2.0", "file", "all", marks=ALL),
    pytest.param("2.0", "embedded", "all", marks=ALL),
    pytest.param("3.0", "file", "all", marks=ALL),
    pytest.param("3.0", "embedded", "all", marks=ALL),
]


@pytest.mark.parametrize(("version", "coefficients", "platform"), KINDS)
def test_units_pass_every_level_by_their_file_alone(
    version: str, coefficients: str, platform: str, model: ReducedModel, tmp_path: Path
) -> None:
    """Both versions of FMI, both places of the coefficients, one platform and five; only the archive is at hand."""
    write = export_fmu if version == "2.0" else export_fmi3
    export = write(model, tmp_path / "x.fmu", FmuSettings(coefficients=coefficients, platforms=(platform,)))
    levels = validate_unit(Path(export.path))
    host = {"newest GNU C library asked for, 2.04 for version 2.4"} if export.compiler != "zig" else set()
    assert [(r.check, r.value) for r in levels.rows if not r.passed and r.check not in host] == []
    assert levels.problems == ()
    counts = {level: sum(r.level == level for r in levels.rows) for level in ("L0", "L1", "L2", "L3")}
    assert (counts["L0"] >= 3, counts["L1"], counts["L2"] >= 7, counts["L3"]) == (True, 9, True, 4)


def test_absolute_outputs_do_not_disturb_the_levels(model: ReducedModel, tmp_path: Path) -> None:
    export_fmu(model, tmp_path / "x.fmu", FmuSettings(absolute=True), info=FmuInfo(base_share=(1.0, 1.0, 0.0)))
    rows = validate_unit(tmp_path / "x.fmu").rows
    assert [r.check for r in rows if not r.passed and "GNU" not in r.check] == []
    assert "L3" in {r.level for r in rows}


def changed_unit(native: FmuExport, path: Path, name: str, content: bytes) -> Path:
    """The unit with one file of its archive exchanged."""
    with zipfile.ZipFile(native.path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    write_archive(path, {**files, name: content})
    return path


def test_a_library_of_another_model_is_found_out(native: FmuExport, model: ReducedModel, tmp_path: Path) -> None:
    """rom.json with one coefficient off by 1e-9: kernel and trajectories miss, states and instances do not."""
    coefficients = model.displacement.coefficients * (1.0 + 1e-9)
    other = dataclasses.replace(model, displacement=dataclasses.replace(model.displacement, coefficients=coefficients))
    unit = changed_unit(native, tmp_path / "x.fmu", "resources/rom.json", model_json(other).encode())
    missed = {r.level for r in validate_unit(unit).rows if not r.passed and "GNU" not in r.check}
    assert "L1" in missed
    assert "L2" not in missed


def test_broken_rules_are_counted_and_named(native: FmuExport, tmp_path: Path) -> None:
    with zipfile.ZipFile(native.path) as archive:
        text = archive.read("modelDescription.xml").decode()
    broken = text.replace('name="logAll"', 'name="logStatusError"')
    levels = validate_unit(changed_unit(native, tmp_path / "x.fmu", "modelDescription.xml", broken.encode()))
    assert not levels.passed
    assert any("logStatusError" in problem for problem in levels.problems)


def test_what_cannot_be_checked_is_said(pythonfmu_unit: FmuExport, model: ReducedModel, tmp_path: Path) -> None:
    source_only = export_fmu(model, tmp_path / "x.fmu", FmuSettings(platforms=()))
    for path in (pythonfmu_unit.path, source_only.path):
        levels = validate_unit(Path(path))
        assert {r.level for r in levels.rows} == {"L0"}
        assert "L1 to L3 need" in levels.notes[0]


LIBRARY = "binaries/linux64/random_panel.so"
DAMAGE = [
    (lambda b: b[: len(b) // 2], "cannot be loaded: its process ended with code"),
    (lambda b: b"", "cannot be loaded: OSError: random_panel.so: file too short"),
]


@pytest.mark.skipif(host_platform() != "linux64", reason="messages of the Linux loader")
@pytest.mark.parametrize(("damage", "message"), DAMAGE)
def test_a_damaged_library_is_a_missed_check_not_a_crash(
    damage, message: str, native: FmuExport, tmp_path: Path
) -> None:
    with zipfile.ZipFile(native.path) as archive:
        content = archive.read(LIBRARY)
    levels = validate_unit(changed_unit(native, tmp_path / "x.fmu", LIBRARY, damage(content)))
    assert "libraries for this machine that cannot be loaded" in [r.check for r in levels.rows if not r.passed]
    assert any(message in problem for problem in levels.problems)
    assert {r.level for r in levels.rows} == {"L0"}


def test_a_model_of_another_unit_is_named(native: FmuExport, tmp_path: Path) -> None:
    unit = changed_unit(native, tmp_path / "x.fmu", "resources/rom.json", model_json(duffing_chain(3)).encode())
    with pytest.raises(InputError, match=r"belongs to another unit; got 6 states and 1 inputs, .* has 4 and 2"):
        validate_unit(unit)


@pytest.mark.parametrize("pattern", [r"<DefaultExperiment[^>]*/>", r'stepSize="[^"]*"'])
def test_without_a_default_step_nothing_is_measured(pattern: str, native: FmuExport, tmp_path: Path) -> None:
    with zipfile.ZipFile(native.path) as archive:
        text, count = re.subn(pattern, "", archive.read("modelDescription.xml").decode())
    assert count == 1
    levels = validate_unit(changed_unit(native, tmp_path / "x.fmu", "modelDescription.xml", text.encode()))
    assert {r.level for r in levels.rows} == {"L0"}
    assert "with a default step" in levels.notes[0]


def test_coefficients_that_are_missing_or_short_are_named(model: ReducedModel, tmp_path: Path) -> None:
    unit = export_fmu(model, tmp_path / "x.fmu", FmuSettings(coefficients="file", platforms=()))
    table = "resources/coefficients.bin"
    with zipfile.ZipFile(unit.path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    write_archive(tmp_path / "missing.fmu", {name: data for name, data in files.items() if name != table})
    with pytest.raises(InputError, match=r"missing.fmu: resources/rom.json: .*coefficients.bin .* is missing"):
        validate_unit(tmp_path / "missing.fmu")
    write_archive(tmp_path / "short.fmu", {**files, table: files[table][:-8]})
    with pytest.raises(InputError, match=r"coefficients.bin has \d+ numbers, the model \d+"):
        validate_unit(tmp_path / "short.fmu")


def test_damaged_units_get_a_verdict_or_one_sentence(model: ReducedModel, tmp_path: Path) -> None:
    """Random damage to description and model never ends in a stack trace."""
    rng = np.random.default_rng(3)
    unit = export_fmu(model, tmp_path / "x.fmu", FmuSettings(platforms=()))
    with zipfile.ZipFile(unit.path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    root = ElementTree.fromstring(files["modelDescription.xml"])
    for _ in range(40):
        text, rom = ElementTree.tostring(damaged(root, rng)), bytearray(files["resources/rom.json"])
        first = int(rng.integers(len(rom)))
        rom[first : first + int(rng.integers(100))] = b"\xff"
        write_archive(tmp_path / "y.fmu", {**files, "modelDescription.xml": text, "resources/rom.json": bytes(rom)})
        for judge in (validate_unit, unit_facts):
            with contextlib.suppress(RomgenError):
                judge(tmp_path / "y.fmu")


def test_a_figure_that_is_not_a_number_does_not_pass() -> None:
    assert not LevelRow("L1", "x", float("nan"), 0.0, 1.0).passed


def test_rom_json_gives_the_model_back(model: ReducedModel) -> None:
    again = model_from_json(model_json(model))
    np.testing.assert_array_equal(again.eigenvalues, model.eigenvalues)
    np.testing.assert_array_equal(again.normal_form.coefficients, model.normal_form.coefficients)
    np.testing.assert_array_equal(again.velocity.coefficients, model.velocity.coefficients)
    assert (again.sensors, again.inputs) == (model.sensors, model.inputs)
    np.testing.assert_array_equal(again.trained_range.facets, model.trained_range.facets)
    z = zeta(random_states(model, 20))
    expected = evaluate(model.chart, z).real
    np.testing.assert_allclose(evaluate(again.chart, z).real, expected, atol=1e-14 * np.abs(expected).max())
    with pytest.raises(InputError, match="not a reduced model"):
        model_from_json('{"format": "other"}')


def test_rom_json_keeps_the_decays_and_reads_files_without_range(model: ReducedModel) -> None:
    found = tried_stability(model.eigenvalues, model.normal_form, model.trained_range, (1.0,))
    tried = dataclasses.replace(found, slowest_rate=np.array([-np.inf]))
    text = model_json(dataclasses.replace(model, stability=tried))
    again = model_from_json(text).stability
    assert again is not None
    np.testing.assert_array_equal(again.slowest_rate, tried.slowest_rate)
    assert (again.starts, again.is_stable) == (tried.starts, tried.is_stable)
    content = {key: value for key, value in json.loads(text).items() if key not in ("trained_facets", "stability")}
    older = model_from_json(json.dumps(content))
    assert older.stability is None
    # the box of the amplitudes, as before there was a range
    np.testing.assert_allclose(older.trained_range.facets, np.diag(1.0 / model.trained_amplitude))
