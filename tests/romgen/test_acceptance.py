"""Limits on the numbers of summary.json."""

from __future__ import annotations

import math
from typing import Any

from romgen.acceptance import Verdict, verdicts
from romgen.settings import AcceptanceSettings

LIMITS = AcceptanceSettings(nmte_percent=5.0, fmu_relative=1e-9, preload_percent=0.1)


def summary(**changes: Any) -> dict[str, Any]:
    pair = {"normal_force_n": 54_600.0, "applied_force_n": 54_600.0, "contact_area_m2": 5e-3}
    content = {
        "preload": {"interfaces": {"joint": pair | changes.get("pair", {})}},
        "learn": {"nmte_percent": {"training": {"a": 99.0}, "validation": {"b": changes.get("nmte", 4.9)}}},
        "ringdowns": {"b": {"energy_imbalance_percent": changes.get("ledger", 0.2)}},
        "forced_validation": [
            {"load": 2.0, "unit": "m/s^2", "frequency_hz": 107.5, "error_percent": changes.get("forced", -9.0)}
        ],
        "fmu": {
            "fmpy_problems": changes.get("problems", 0),
            "missed_checks": changes.get("checks", []),
            "native_vs_python_rel": changes.get("rel", 1e-12),
            "pythonfmu_vs_python_rel": changes.get("python_rel", 1e-12),
            "replay_nmte_percent": {"b": changes.get("replay", 4.9)},
        },
    }
    return {key: value for key, value in content.items() if key not in changes.get("absent", ())}


def missed(**changes: Any) -> list[str]:
    return [verdict.name for verdict in verdicts(summary(**changes), LIMITS) if not verdict.passed]


def test_training_errors_are_not_judged() -> None:
    assert missed() == []
    assert len(verdicts(summary(), LIMITS)) == 9


def test_each_limit_can_be_missed() -> None:
    assert missed(pair={"normal_force_n": 54_600.0 * 0.9985}) == ["preload.joint force error %"]
    assert missed(pair={"normal_force_n": 54_600.0 * 0.9995}) == []
    assert missed(nmte=5.1) == ["learn.nmte_percent.b"]
    assert missed(nmte=None) == ["learn.nmte_percent.b"]
    assert missed(problems=1) == ["fmu.fmpy_problems"]
    assert missed(checks=["L2: serialised"]) == ["fmu.missed_checks"]
    assert missed(checks=["L0: newest GNU C library"]) == []
    assert missed(rel=2e-9) == ["fmu.native_vs_python_rel"]
    assert missed(ledger=0.6) == ["ringdowns.b energy imbalance %"]
    assert missed(forced=-10.1) == ["forced_validation.2 m/s^2 107.50 Hz amplitude error %"]
    assert missed(python_rel=2e-9) == ["fmu.pythonfmu_vs_python_rel"]
    assert missed(replay=5.1) == ["fmu.replay_nmte_percent.b"]
    assert missed(rel=None) == ["fmu.native_vs_python_rel"]


def test_what_is_absent_or_undetermined_is_not_judged() -> None:
    assert verdicts(summary(absent=tuple(summary())), LIMITS) == ()
    assert len(verdicts(summary(pair={"applied_force_n": None}), LIMITS)) == 8
    assert not Verdict("x", math.nan, 1.0).passed
