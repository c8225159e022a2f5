"""A study from recorded data with a calibrated load: stages, keys, summary, report, inputs of the FMU."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from typer.testing import CliRunner

from romgen.cli.app import app
from romgen.fmu.model_file import model_from_json
from romgen.load_calibration import Forcing
from romgen.pipeline import reduced_model, run, stages_of
from romgen.runner import RunResult
from romgen.settings import load_study
from tests.lab_study import write_lab_study

PEAK = '{ level = 3.0, sensor = "mid", amplitude = "0.2 mm" }'
FORCING = """
[forcing.base_acceleration]
points = [POINT]
[forced_response]
levels = [2.0]
sensor = "mid"
[fmu]
pythonfmu = false
"""


@pytest.fixture(scope="module")
def study_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = write_lab_study(tmp_path_factory.mktemp("lab"))
    path.write_text(path.read_text(encoding="utf-8") + FORCING.replace("POINT", PEAK), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def finished(study_path: Path, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return run(load_study(study_path), tmp_path_factory.mktemp("runs") / "lab")


def test_order_of_the_stages(study_path: Path) -> None:
    names = [stage.name for stage in stages_of(load_study(study_path))]
    assert names[:6] == ["data", "learn", "forcing", "forced_response", "backbone", "fmu"]


def test_load_reaches_model_and_response(finished: RunResult) -> None:
    """Almost linear data: the response at 2 m/s2 peaks at two thirds of what was measured at 3 m/s2."""
    summary = json.loads((finished.run_dir / "summary.json").read_text(encoding="utf-8"))
    part = summary["forcing"]["base_acceleration"]
    assert part["unit"] == "m/s2"
    assert part["source"] == "points"
    assert part["spread_percent"] is None
    assert part["deviation_percent"][1] is None
    assert part["points"][0]["peak"]
    assert part["points"][0]["model_m"] == pytest.approx(0.2e-3, rel=1e-6)
    (curve,) = summary["forced_response"]["curves"]
    # coupling terms 1j and 2j over damping 3.2 at z = 0.18: the peak bends by a few percent at most
    assert curve["peak_m"] == pytest.approx(2.0 / 3.0 * 0.2e-3, rel=0.05)
    model = reduced_model(finished)
    assert model.inputs == ("base_acceleration",)
    f = finished.context.record("forcing", Forcing).loads[0].modal_load
    # at resonance eta'' = f u balances the damping force 2 abs(Re lambda) omega eta
    eigenvalue = model.eigenvalues[0]
    assert f[0] == pytest.approx(-2.0 * abs(eigenvalue.real) * eigenvalue.imag * 0.2e-3 / 3.0, rel=0.1)


def test_everyone_is_told(finished: RunResult) -> None:
    messages = finished.infos["forcing"].messages
    assert any("not computed but calibrated on 1 measured point" in line for line in messages)
    page = (finished.run_dir / "report.html").read_text(encoding="utf-8")
    assert '<section id="forcing"' in page
    assert "peak of the response" in page
    assert "calibrated on 1 measured point" in page


def test_unit_has_the_input_with_the_range_of_the_levels(finished: RunResult) -> None:
    description = read_model_description(str(finished.run_dir / "lab.fmu"))
    (variable,) = [v for v in description.modelVariables if v.causality == "input"]
    assert (variable.name, variable.unit, float(variable.min), float(variable.max)) == (
        "base_acceleration",
        "m/s2",
        -2.0,
        2.0,
    )
    summary = json.loads((finished.run_dir / "summary.json").read_text(encoding="utf-8"))
    assert summary["fmu"]["fmpy_problems"] == 0
    assert summary["fmu"]["native_vs_python_rel"] < 1e-9


def test_another_point_costs_no_learning(finished: RunResult, study_path: Path) -> None:
    """The backbone does not depend on the load either."""
    path = study_path.with_name("other.toml")
    path.write_text(study_path.read_text(encoding="utf-8").replace("0.2 mm", "0.3 mm"), encoding="utf-8")
    before = reduced_model(finished).input_matrix
    again = run(load_study(path), finished.run_dir, until="validation")
    assert again.computed == ("forcing", "forced_response", "fmu", "validation")
    assert np.abs(reduced_model(again).input_matrix[0, 0] / before[0, 0]) == pytest.approx(1.5, rel=0.1)


def test_learn_writes_the_model_with_its_inputs(study_path: Path, tmp_path: Path) -> None:
    asked = ["learn", str(study_path), "--run-dir", str(tmp_path), "--model-json", str(tmp_path / "model.json")]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == 0, result.stderr
    model = model_from_json((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert model.inputs == ("base_acceleration",)
    assert np.abs(model.input_matrix[0, 0]) > 0.0


def test_point_out_of_reach_is_one_line(study_path: Path, finished: RunResult) -> None:
    path = study_path.with_name("far.toml")
    path.write_text(study_path.read_text(encoding="utf-8").replace("0.2 mm", "200 mm"), encoding="utf-8")
    result = CliRunner().invoke(app, ["run", str(path), "--run-dir", str(finished.run_dir)])
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert "[forcing.base_acceleration] point 1: the model does not reach" in result.stderr
