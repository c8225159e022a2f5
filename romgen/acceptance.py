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
        *_learn(summary.get("learn", {}), limits),
        *_fmu(summary.get("fmu", {}), limits),
    )


def _preload(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for name, pair in part.get("interfaces", {}).items():
        applied = _number(pair["applied_force_n"])
        if math.isfinite(applied) and applied != 0.0:
            error = 100.0 * abs(_number(pair["normal_force_n"]) / applied - 1.0)
            yield Verdict(f"preload.{name} force error %", error, limits.preload_percent)


def _learn(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    for name, error in part.get("nmte_percent", {}).get("validation", {}).items():
        yield Verdict(f"learn.nmte_percent.{name}", _number(error), limits.nmte_percent)


def _fmu(part: dict[str, Any], limits: AcceptanceSettings) -> Iterator[Verdict]:
    if "fmpy_problems" in part:
        yield Verdict("fmu.fmpy_problems", part["fmpy_problems"], 0.0)
        yield Verdict("fmu.native_vs_python_rel", _number(part["native_vs_python_rel"]), limits.fmu_relative)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
