"""Several studies through one executor."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from romgen.cli.app import app
from romgen.errors import InputError
from romgen.executor import SerialExecutor
from romgen.sweep import sweep
from tests.lab_study import write_lab_study


@pytest.fixture
def studies(tmp_path: Path) -> list[Path]:
    """The lab study, the same with a wrong trajectory name, both with names of their own."""
    good = write_lab_study(tmp_path)
    bad = tmp_path / "bad.toml"
    bad.write_text(good.read_text().replace('"lab"', '"bad"').replace('"other"', '"gone"'), encoding="utf-8")
    return [good, bad]


def test_a_failure_does_not_end_the_others(studies: list[Path], tmp_path: Path) -> None:
    good, bad = sweep(studies, tmp_path / "runs", SerialExecutor())
    assert good.summary is not None
    assert good.summary["study"] == "lab"
    assert (tmp_path / "runs" / "lab" / "report.html").is_file()
    assert (bad.summary, bad.exit_code) == (None, 2)
    assert "no such trajectory in the files; got gone" in bad.error


def test_names_must_differ(studies: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="two studies have the same name; got lab, lab"):
        sweep([studies[0], studies[0]], tmp_path, SerialExecutor())


def test_command_prints_one_line_per_study(studies: list[Path], tmp_path: Path) -> None:
    arguments = ["sweep", *map(str, studies), "--root", str(tmp_path / "runs"), "--executor", "serial"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert len(result.stdout.splitlines()) == 3
    document = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    assert document[str(studies[0])]["study"] == "lab"
    assert "no such trajectory" in document[str(studies[1])]["error"]
