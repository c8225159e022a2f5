"""modelDescription.xml: valid, complete, consistent with the equations, and repeatable."""

from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description

from romgen.errors import InputError
from romgen.fmu.driver import Slave, fmpy_problems
from romgen.fmu.export import export_fmu
from romgen.fmu.export3 import export_fmi3
from romgen.fmu.interface import build_interface
from romgen.fmu.records import FmuExport, FmuInfo
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model, random_states

SOURCE_ONLY = FmuSettings(platforms=())


def test_fmpy_finds_no_problem(native: FmuExport) -> None:
    assert fmpy_problems(native.path) == ()


def test_every_unit_is_declared_with_its_exponents(unpacked: Path) -> None:
    root = ElementTree.parse(unpacked / "modelDescription.xml").getroot()
    declared = {unit.get("name"): unit for unit in root.iter("Unit")}
    used = {real.get("unit") for real in root.iter("Real")}
    assert used <= set(declared)
    assert {"1", "m", "m/s", "m/s2", "s", "Hz"} <= used
    assert declared["m/s2"].find("BaseUnit").attrib == {"m": "1", "s": "-2"}
    gravity = declared["m/s2"].find("DisplayUnit")
    assert gravity.get("name") == "g"
    assert 9.80665 * float(gravity.get("factor")) == pytest.approx(1.0, rel=1e-15)


def test_names_are_flat_identifiers_without_repetition(native: FmuExport) -> None:
    names = [v.name for v in read_model_description(native.path).modelVariables]
    assert len(set(names)) == len(names)
    assert all(name.isascii() and name.isidentifier() for name in names)
    assert {"base_acceleration", "mid_span_displacement", "mid_span_velocity", "trust_ratio", "z1_re"} <= set(names)


def test_clashing_sensor_names_are_numbered() -> None:
    model = dataclasses.replace(random_model(2), sensors=("a b", "a.b", "0c"))
    names = [v.name for v in build_interface(model).variables]
    assert {"y_1_a_b", "y_2_a_b", "v_3_0c"} <= set(names)


def test_dependencies_are_those_of_the_equations(slave: Slave, model: ReducedModel) -> None:
    """Every declared dependency shows in some directional derivative, and no other one does."""
    interface = build_interface(model)
    by_index = dict(enumerate(interface.variables, 1))
    knowns = [k for k, v in by_index.items() if v.name.startswith("z") or v.causality == "input"]
    unknowns = [u for u in (*interface.outputs, *interface.derivatives) if by_index[u.index].unit]
    seen = np.zeros((len(unknowns), len(knowns)), dtype=bool)
    for z in random_states(model, 8):
        slave.fmu.setReal(slave.references.states, np.stack([z.real, z.imag], axis=-1).ravel().tolist())
        for j, known in enumerate(knowns):
            references = [by_index[u.index].reference for u in unknowns]
            slope = slave.fmu.getDirectionalDerivative(references, [by_index[known].reference], [1.0])
            seen[:, j] |= np.array(slope) != 0.0
    declared = np.array([[known in u.dependencies for known in knowns] for u in unknowns])
    np.testing.assert_array_equal(seen, declared)


def test_uncoupled_modes_are_declared_uncoupled() -> None:
    """A model whose chart and normal form keep the modes apart: the list of dependencies is sparse."""
    model = random_model(2)
    keep = np.all(model.normal_form.exponents == 0, axis=1)
    chart = model.chart.coefficients.copy()
    mixed = (model.chart.exponents[:, [0, 2]].sum(axis=1) > 0) == np.array([[False], [True], [False], [True]])
    chart[mixed] = 0.0
    sparse = dataclasses.replace(
        model,
        normal_form=dataclasses.replace(model.normal_form, coefficients=model.normal_form.coefficients * keep),
        chart=dataclasses.replace(model.chart, coefficients=chart),
    )
    interface = build_interface(sparse)
    first, _, third, _ = interface.derivatives
    states = set(range(1, 5))
    assert set(first.dependencies) & states == {1, 2}
    assert set(third.dependencies) & states == {3, 4}


def test_initial_unknowns_are_all_calculated_outputs_and_rates(model: ReducedModel) -> None:
    interface = build_interface(model)
    expected = [k for k, v in enumerate(interface.variables, 1) if v.initial == "calculated"]
    assert [u.index for u in interface.initial_unknowns] == expected


def test_the_same_model_gives_the_same_bytes_anywhere(
    native: FmuExport, model: ReducedModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    again = export_fmu(model, Path("elsewhere") / "other_name.fmu", FmuSettings())
    assert again.sha256 == native.sha256


def test_another_coefficient_gives_another_guid(native: FmuExport, model: ReducedModel, tmp_path: Path) -> None:
    changed = dataclasses.replace(model, trained_amplitude=model.trained_amplitude * (1.0 + 1e-15))
    assert export_fmu(changed, tmp_path / "x.fmu", SOURCE_ONLY).guid != native.guid


def test_source_date_epoch_is_the_date(model: ReducedModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    export_fmu(model, tmp_path / "x.fmu", SOURCE_ONLY)
    assert read_model_description(tmp_path / "x.fmu").generationDateAndTime == "2023-11-14T22:13:20Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(InputError, match="yesterday"):
        export_fmu(model, tmp_path / "x.fmu", SOURCE_ONLY)


def test_the_information_reaches_description_documentation_and_icon(model: ReducedModel, tmp_path: Path) -> None:
    info = FmuInfo(
        description="A panel <between> blocks",
        author="A & B",
        origin=("three ring-downs",),
        errors_percent=(("mixed", 2.345),),
        input_range=((-50.0, 50.0), (-2.0, 2.0)),
        stop_time=0.25,
        picture=b"\x89PNG",
    )
    export_fmu(model, tmp_path / "x.fmu", FmuSettings(platforms=(), sensors=("upper",), step_size=5e-5), info=info)
    description = read_model_description(tmp_path / "x.fmu")
    assert (description.description, description.author) == ("A panel <between> blocks", "A & B")
    assert (description.defaultExperiment.stopTime, description.defaultExperiment.stepSize) == ("0.25", "5e-05")
    (load, _) = [v for v in description.modelVariables if v.causality == "input"]
    assert (float(load.min), float(load.max), float(load.nominal)) == (-50.0, 50.0, 50.0)
    assert [v.name for v in description.modelVariables if v.unit == "m"] == ["upper_displacement"]
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        page = archive.read("documentation/index.html").decode()
        assert archive.read("model.png") == b"\x89PNG"
    assert "A panel &lt;between&gt; blocks" in page
    assert "three ring-downs" in page
    assert "2.35" in page or "2.34" in page


def test_ranges_must_fit_the_inputs_and_hold_their_start_value(model: ReducedModel, tmp_path: Path) -> None:
    for ranges, message in (
        (((-1.0, 1.0),), "one range per input"),
        (((1.0, 2.0), (-1.0, 1.0)), "base_acceleration must hold 0"),
        (((-1.0, 1.0), (0.0, 0.0)), "shaker force must hold 0"),
        (((-1.0, float("inf")), (-1.0, 1.0)), "base_acceleration must hold 0"),
    ):
        with pytest.raises(InputError, match=message):
            export_fmu(model, tmp_path / "x.fmu", SOURCE_ONLY, info=FmuInfo(input_range=ranges))


def test_units_of_all_kinds_carry_icon_and_ranges(
    pythonfmu_unit: FmuExport, model: ReducedModel, tmp_path: Path
) -> None:
    info = FmuInfo(input_range=((-50.0, 40.0), (-2.0, 2.0)))
    export_fmu(model, tmp_path / "two.fmu", SOURCE_ONLY, info=info)
    export_fmi3(model, tmp_path / "three.fmu", SOURCE_ONLY, info=info)
    places = ((tmp_path / "two.fmu", "model.png"), (tmp_path / "three.fmu", "terminalsAndIcons/icon.png"))
    for path, name in (*places, (Path(pythonfmu_unit.path), "model.png")):
        with zipfile.ZipFile(path) as archive:
            assert archive.read(name).startswith(b"\x89PNG\r\n\x1a\n")
    for path, _ in places:
        loads = [v for v in read_model_description(path).modelVariables if v.causality == "input"]
        assert [(float(v.min), float(v.max)) for v in loads] == [(-50.0, 40.0), (-2.0, 2.0)]
