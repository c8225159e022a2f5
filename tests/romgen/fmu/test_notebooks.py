"""Every notebook runs: its code cells, one after the other, with a small unit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from romgen.fmu.export import export_fmu
from romgen.fmu.export3 import export_fmi3
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model

ROOT = Path(__file__).parents[3]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A small model for FMI 2.0 and FMI 3.0."""
    folder = tmp_path_factory.mktemp("notebooks")
    export_fmu(random_model(3), folder / "x.fmu", FmuSettings())
    export_fmi3(random_model(3), folder / "x_fmi3.fmu", FmuSettings())
    return folder / "x.fmu", folder / "x_fmi3.fmu"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(
    path: Path, units: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROMGEN_UNIT", str(units[0]))
    monkeypatch.setenv("ROMGEN_UNIT3", str(units[1]))
    monkeypatch.setenv("ROMGEN_EXAMPLE", str(ROOT / "models" / "coupled_feedback"))
    monkeypatch.syspath_prepend(".")
    names: dict[str, object] = {"__name__": path.stem}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), path.name, "exec"), names)
    assert capsys.readouterr().out


def test_there_is_one_for_each_door() -> None:
    assert {path.stem for path in NOTEBOOKS} == {"co_simulation", "model_exchange", "fmi3", "ssp", "rollback"}
