"""The command line: exit codes, one line per mistake, JSON for machines, nothing when quiet."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from fmpy import read_model_description
from typer.testing import CliRunner, Result

import romgen
from romgen.cli import report as report_command
from romgen.cli import run as run_command
from romgen.cli.app import app
from romgen.errors import NumericalError
from romgen.fmu.model_file import model_from_json, model_json
from romgen.settings import load_study
from tests.lab_study import write_lab_study

ROOT = Path(__file__).parents[3]
COMMANDS = ("run", "check", "learn", "frc", "export", "validate", "report", "info", "doctor")


def romgen_cli(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_every_command_explains_itself() -> None:
    for command in COMMANDS:
        assert romgen_cli(command, "--help").exit_code == 0
    assert romgen_cli("--version").stdout.strip() == romgen.__version__


@pytest.mark.parametrize("command", [c for c in COMMANDS if c != "doctor"])
def test_mistakes_are_one_line_and_exit_2(command: str, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text('[study]\nname = "a"\n[data]\nfiles = ["gone.mat"]\nsensors = ["x"]\ntraining = [0]\nsensor = 1\n')
    result = romgen_cli(command, study)
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("romgen: study.toml: [data] unknown key 'sensor'; did you mean 'sensors'?")
    assert "no such file" in lines[1]


@pytest.mark.parametrize("command", [c for c in COMMANDS if c != "doctor"])
def test_missing_file(command: str, tmp_path: Path) -> None:
    result = romgen_cli(command, tmp_path / "gone.toml")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize("place", ["a_file", "a_file/below", "/proc/nowhere"])
def test_a_run_folder_that_cannot_be_made_is_one_line(place: str, tmp_path: Path) -> None:
    """A file in the way, a path below a file, a file system that takes no folders."""
    write_lab_study(tmp_path)
    (tmp_path / "a_file").write_text("in the way")
    for more in ([], ["--json"]):
        result = romgen_cli("learn", tmp_path / "study.toml", "--run-dir", tmp_path / place, *more)
        assert result.exit_code == 2
        assert len(result.stderr.splitlines()) == 1
        assert "check the path and its permissions" in result.stderr
    assert json.loads(result.stdout)["exit_code"] == 2


def test_a_report_that_fails_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise NumericalError("did not converge")

    write_lab_study(tmp_path)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "report.html").write_text("old")
    monkeypatch.setattr(report_command, "bring_up_to_date", fail)
    assert romgen_cli("report", tmp_path / "study.toml", "--run-dir", tmp_path / "run").exit_code == 3
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["report.html"]
    assert (tmp_path / "run" / "report.html").read_text() == "old"


def test_info_on_a_folder_that_holds_nothing(tmp_path: Path) -> None:
    result = romgen_cli("info", tmp_path)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "it has no result.h5 or study.toml" in result.stderr


def test_problems_as_json(tmp_path: Path) -> None:
    result = romgen_cli("check", tmp_path / "gone.toml", "--json")
    assert result.exit_code == 2
    assert json.loads(result.stdout)["exit_code"] == 2


@pytest.mark.parametrize(
    ("key", "entry", "message"),
    [
        ("unit", '"furlong"', "unknown unit"),
        ("training", "[0, 99]", "no such trajectory in the files"),
        ("files", '["junk.mat"]', "junk.mat: "),
    ],
)
def test_check_opens_the_data(key: str, entry: str, message: str, tmp_path: Path) -> None:
    study = write_lab_study(tmp_path)
    (tmp_path / "junk.mat").write_bytes(b"nothing that MATLAB wrote" * 20)
    lines = study.read_text().splitlines()
    kept = [line for line in lines if not line.startswith(f"{key} =")]
    kept.insert(kept.index("[data]") + 1, f"{key} = {entry}")
    study.write_text("\n".join(kept) + "\n")
    result = romgen_cli("check", study)
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert message in result.stderr


def test_check_says_what_it_will_cost() -> None:
    result = romgen_cli("check", ROOT / "models" / "clamped_panel")
    assert result.exit_code == 0
    assert "3 training and 2 validation ring-downs" in result.stdout
    assert "GB" in result.stdout
    document = json.loads(romgen_cli("check", ROOT / "models" / "clamped_panel", "--json").stdout)
    assert document["estimate"]["dofs"] > 1000
    assert romgen_cli("check", ROOT / "models" / "clamped_panel", "--quiet").stdout == ""


def test_doctor_and_unknown_files(tmp_path: Path) -> None:
    result = romgen_cli("doctor", "--json")
    assert json.loads(result.stdout)["required"]["numpy"]
    (tmp_path / "picture.png").write_bytes(b"x")
    assert "unknown kind of file" in romgen_cli("info", tmp_path / "picture.png").stderr
    for name in ("a.fmu", "a.h5", "a.json"):
        (tmp_path / name).write_bytes(b"not one")
        result = romgen_cli("info", tmp_path / name)
        assert result.exit_code == 2, name
        assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("failure", "code"), [(NumericalError("did not converge", where="preload"), 3), (KeyboardInterrupt(), 130)]
)
def test_failures_while_running(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException, code: int
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise failure

    monkeypatch.setattr(run_command, "run_pipeline", fail)
    result = romgen_cli("run", write_lab_study(tmp_path), "--run-dir", tmp_path)
    assert result.exit_code == code
    assert len(result.stderr.splitlines()) == 1


def test_python_m_romgen_has_no_trace_and_no_colour(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "romgen", "run", str(tmp_path / "gone.toml")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr
    assert "\x1b" not in done.stderr + done.stdout


def test_a_study_from_start_to_end(tmp_path: Path) -> None:
    study, folder = write_lab_study(tmp_path), tmp_path / "run folder ü"
    learned = romgen_cli("learn", study, "--run-dir", folder, "--model-json", tmp_path / "model.json")
    assert learned.exit_code == 0, learned.stderr
    assert "validation" in learned.stdout
    text = (tmp_path / "model.json").read_text(encoding="utf-8")
    assert model_json(model_from_json(text)) == text
    exported = romgen_cli("export", study, "--run-dir", folder, "--json")
    assert json.loads(exported.stdout)["path"] == "lab.fmu"
    sensor = load_study(study).sensor_names[0]
    chosen = romgen_cli("export", study, "--run-dir", folder, "--backend", "c", "--sensors", sensor)
    assert chosen.exit_code == 0, chosen.stderr
    assert "pythonfmu" not in chosen.stdout
    names = {v.name for v in read_model_description(str(folder / "lab.fmu")).modelVariables if v.causality == "output"}
    assert {name for name in names if name.endswith("_displacement")} == {f"{sensor}_displacement"}
    both = romgen_cli("export", study, "--run-dir", folder, "--backend", "python")
    assert "lab_pythonfmu.fmu" in both.stdout
    assert (folder / "lab_pythonfmu.fmu").exists()
    wrong = romgen_cli("export", study, "--run-dir", folder, "--sensors", "nowhere")
    assert wrong.exit_code == 2
    assert "--sensors: unknown sensor" in wrong.stderr
    validated = romgen_cli("validate", study, "--run-dir", folder)
    assert validated.exit_code == 0, validated.stderr
    ran = romgen_cli("run", study, "--run-dir", folder)
    assert ran.exit_code == 0, ran.stderr
    assert str(folder / "report.html") in ran.stdout
    assert romgen_cli("validate", folder / "lab.fmu").exit_code == 0
    assert "lab: FMI 2.0" in romgen_cli("info", folder / "lab.fmu").stdout
    assert "learn" in romgen_cli("info", folder).stdout
    assert "learn.order = 3" in romgen_cli("info", folder / "summary.json").stdout
    assert romgen_cli("frc", study, "--run-dir", folder).exit_code == 2
    study.write_text(study.read_text() + "[acceptance]\nnmte_percent = 1e-9\n")
    missed = romgen_cli("validate", study, "--run-dir", folder)
    assert missed.exit_code == 4
    assert "learn.nmte_percent.other" in missed.stderr
