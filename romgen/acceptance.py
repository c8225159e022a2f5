"""Judges the numbers of summary.json by the limits of table [acceptance]."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from romgen.settings import AcceptanceSettings


@dataclass(frozen=True)
class Verdict:
    """One measured number and its limit.

    Attributes
    ----------
    name : key in summary.json, shortened.
    value : what was measured.
    limit : largest accepted value.
    """

    name: str
    value: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit; a number that is not finite never is."""
        return math.isfinite(self.value) and self.value <= self.limit


def verdicts(summary: dict[str, Any], limits: AcceptanceSettings) -> tuple[Verdict, ...]:
    """Return a verdict for every number in the summary that has a limit.

    Parameters
    ----------
    summary : content of summary.json; absent stages are not judged.
    limits : table [acceptance].
    """
    return (
        *_preload(summary.get("preload", {}), limits),
        *_ledger(summary.get("ringdowns", {}), limits),
        *_learn(summary.get("learn", {}), limits),
        *_forced(summary.get("forced_validation", []), limits),
        *_fmu(summary.get("fmu", {}), limits),
    )


def _preload(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for name, pair in part.get("interfaces", {}).items():
        applied = _number(pair["applied_force_n"])
        if math.isfinite(applied) and applied != 0.0:
            error = 100.0 * abs(_number(pair["normal_force_n"]) / applied - 1.0)
            yield Verdict(f"preload.{name} force error %", error, limits.preload_percent)


def _ledger(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for name, motion in part.items():
        error = _number(motion["energy_imbalance_percent"])
        yield Verdict(f"ringdowns.{name} energy imbalance %", error, limits.ledger_percent)


def _learn(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for name, error in part.get("nmte_percent", {}).get("validation", {}).items():
        yield Verdict(f"learn.nmte_percent.{name}", _number(error), limits.nmte_percent)


def _forced(part: list[dict[str, Any]], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for point in part:
        name = f"forced_validation.{point['load']:g} {point['unit']} {point['frequency_hz']:.2f} Hz amplitude error %"
        yield Verdict(name, abs(_number(point["error_percent"])), limits.forced_percent)


def _fmu(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    if "fmpy_problems" in part:
        yield Verdict("fmu.fmpy_problems", part["fmpy_problems"], 0.0)
        # L0: structure is judged above; which C library a unit asks for lies with the compiler of this machine
        behaviour = [check for check in part["missed_checks"] if not check.startswith("L0")]
        yield Verdict("fmu.missed_checks", len(behaviour), 0.0)
        yield Verdict("fmu.native_vs_python_rel", _number(part["native_vs_python_rel"]), limits.fmu_relative)
    if "pythonfmu_vs_python_rel" in part:
        error = _number(part["pythonfmu_vs_python_rel"])
        yield Verdict("fmu.pythonfmu_vs_python_rel", error, limits.fmu_relative)
    for name, error in part.get("replay_nmte_percent", {}).items():
        yield Verdict(f"fmu.replay_nmte_percent.{name}", _number(error), limits.nmte_percent)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
