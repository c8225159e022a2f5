"""summary.json: promised keys of the finite-element stages, strict JSON, documentation that matches."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from romgen.model_stages import RingDowns
from romgen.result_store import ResultStore, StageInfo
from romgen.runner import RunResult
from romgen.settings import Study
from romgen.stage import Context
from romgen.structure import EnergyLedger, FrequencyRatio, Interface, Modes, Preload, RingDown, StepEffort
from romgen.summary import summarise, write_summary
from romgen.trajectory import Trajectory
from tests.romgen.settings.conftest import STUDY

PAGE = (Path(__file__).parents[2] / "docs" / "summary.md").read_text(encoding="utf-8")
EMPTY = np.zeros(0)


def interface() -> Interface:
    zero = np.zeros(1)
    status = np.ones(1, np.int64)
    return Interface(
        name="joint",
        points=np.zeros((1, 3)),
        area=zero,
        pressure=zero,
        traction=np.zeros((1, 2)),
        gap=zero,
        status=status,
        normal_force_n=999.0,
        applied_force_n=float("nan"),
        contact_area_m2=0.005,
    )


def ring_down(name: str) -> RingDown:
    t = np.array([0.0, 1.0, 2.0])
    trajectory = Trajectory(name, t, ("tip",), np.array([[2e-3], [-3e-3], [1e-3]]))
    zero = np.zeros(3)
    energy = EnergyLedger(
        zero, zero, zero, np.array([0.0, 0.5, 1.0]), np.array([0.0, 2.0, 3.0]), zero, np.array([0.0, 0.01, -0.02])
    )
    effort = StepEffort(np.array([0, 1, 3]), np.array([0, 0, 2]), np.array([0, 0, 1]))
    return RingDown(trajectory, energy, np.array([0, 3, 5]), effort)


@pytest.fixture
def summary(tmp_path: Path) -> dict[str, Any]:
    modes = Modes(
        np.array([110.0, 198.0]),
        np.array([0.004, 0.004]),
        *([np.zeros((0, 0))] * 3),
        (),
        (),
        (),
        np.zeros((0, 0)),
        0,
        0,
        near_ratios=(FrequencyRatio(0, 1, 1, 2, -0.1),),
    )
    records = {
        "preload": Preload(EMPTY, (interface(),), EMPTY, EMPTY),
        "modes": modes,
        "ringdowns": RingDowns((ring_down("a"),), (ring_down("b"),)),
    }
    store, keys = ResultStore(tmp_path), dict.fromkeys(records, "k")
    for name, record in records.items():
        store.write(name, record, StageInfo("k", 2.5, 10**8, ("a fallback",)))
    context = Context(Study.model_validate(STUDY), tmp_path, store, keys)
    result = RunResult(tmp_path, (), (), context.infos(), context)
    write_summary(tmp_path / "summary.json", summarise(result))
    content: dict[str, Any] = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    return content


def test_preload(summary: dict[str, Any]) -> None:
    expected = {"normal_force_n": 999.0, "applied_force_n": None, "contact_area_m2": 0.005}
    assert summary["preload"]["interfaces"] == {"joint": expected}


def test_modes(summary: dict[str, Any]) -> None:
    assert summary["modes"] == {
        "frequency_hz": [110.0, 198.0],
        "damping_ratio": [0.004, 0.004],
        "ratio": 1.8,
        "near_integer_ratios": [{"modes": [1, 2], "ratio": "1:2", "detuning_percent": pytest.approx(-10.0)}],
    }


def test_ringdowns(summary: dict[str, Any]) -> None:
    assert set(summary["ringdowns"]) == {"a", "b"}
    assert summary["ringdowns"]["a"] == {
        "peak_m": 3e-3,
        "energy_imbalance_percent": 0.5,
        "mean_iterations": 4.0,
        "rejected_steps": 2,
    }


def test_stages_and_absent_keys(summary: dict[str, Any]) -> None:
    assert summary["stages"]["modes"] == {"wall_s": 2.5, "peak_memory_bytes": 10**8, "messages": ["a fallback"]}
    assert {"learn", "fmu", "forced_response", "backbone"} & set(summary) == set()


def test_every_top_level_key_is_documented(summary: dict[str, Any]) -> None:
    documented = {match.split(".")[0].removesuffix("[]") for match in re.findall(r"^\| `([^`]+)`", PAGE, re.MULTILINE)}
    assert set(summary) - documented == set()


def test_numbers_that_are_not_finite_become_null(tmp_path: Path) -> None:
    content = {"a": np.array([1.0, np.inf]), "b": complex(1.0, np.nan), "c": (np.float64(2.0), np.int64(3))}
    write_summary(tmp_path / "s.json", content)
    assert json.loads((tmp_path / "s.json").read_text()) == {"a": [1.0, None], "b": [1.0, None], "c": [2.0, 3]}
