"""summary.json: the headline numbers of a run under the stable keys of docs/summary.md."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import romgen
from romgen.fmu_stages import Exported, Validation
from romgen.forced_curve import ForcedResponse
from romgen.forced_stages import Backbones
from romgen.forced_validation import ForcedValidation
from romgen.forcing_stages import forcing_summary
from romgen.learning_stages import learning_summary
from romgen.load_histories import LoadHistories
from romgen.model_stages import RingDowns
from romgen.runner import RunResult
from romgen.stage import Context, study_key
from romgen.store import replace_atomically
from romgen.structure import Modes, Preload, RingDown

BACKBONE_POINTS = 50


def summarise(result: RunResult) -> dict[str, Any]:
    """Return the content of summary.json for all stages that are stored and up to date."""
    context = result.context
    content: dict[str, Any] = {
        "study": context.study.name,
        "romgen_version": romgen.__version__,
        "study_sha256": study_key(context.study),
    }
    for stage, (key, part) in PARTS.items():
        if stage in result.infos:
            found = part(context)
            content[key] = content.get(key, {}) | found if isinstance(found, dict) else found
    content["stages"] = {
        name: {"wall_s": info.wall_s, "peak_memory_bytes": info.peak_memory_bytes, "messages": list(info.messages)}
        for name, info in result.infos.items()
    }
    return content


def write_summary(path: Path, content: dict[str, Any]) -> None:
    """Write the summary as strict JSON, atomically; numbers that are not finite become null."""
    text = json.dumps(_plain(content), indent=1, allow_nan=False)

    def write(temporary: Path) -> None:
        temporary.write_text(text + "\n", encoding="utf-8")

    replace_atomically(path, write)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, complex):
        return [_plain(value.real), _plain(value.imag)]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _preload(context: Context) -> dict[str, Any]:
    preload = context.record("preload", Preload)
    return {
        "interfaces": {
            pair.name: {
                "normal_force_n": pair.normal_force_n,
                "applied_force_n": pair.applied_force_n,
                "contact_area_m2": pair.contact_area_m2,
            }
            for pair in preload.interfaces
        }
    }


def _modes(context: Context) -> dict[str, Any]:
    modes = context.record("modes", Modes)
    part: dict[str, Any] = {"frequency_hz": modes.frequency_hz, "damping_ratio": modes.damping_ratio}
    part["near_integer_ratios"] = [
        {"modes": [r.first + 1, r.second + 1], "ratio": f"{r.low}:{r.high}", "detuning_percent": 100.0 * r.detuning}
        for r in modes.near_ratios
    ]
    if len(modes.effective_mass):
        part |= {"effective_mass_kg": modes.effective_mass, "total_mass_kg": modes.total_mass}
    return part | ({"ratio": modes.frequency_hz[1] / modes.frequency_hz[0]} if len(modes.frequency_hz) > 1 else {})


def _ringdowns(context: Context) -> dict[str, Any]:
    ringdowns = context.record("ringdowns", RingDowns)
    return {item.trajectory.name: _ringdown(item) for item in ringdowns.training + ringdowns.validation}


def _ringdown(item: RingDown) -> dict[str, float | int]:
    energy = item.energy
    dissipated = float(energy.damping[-1] + energy.friction[-1])
    return {
        "peak_m": float(np.max(np.abs(item.trajectory.displacement))),
        "energy_imbalance_percent": 100.0 * float(np.max(np.abs(energy.imbalance))) / dissipated,
        "mean_iterations": float(np.mean(item.iterations[1:])),
        "rejected_steps": int(np.sum(item.effort.rejected)),
    }


def _forced_response(context: Context) -> dict[str, Any]:
    response = context.record("forced_response", ForcedResponse)
    return {
        "wall_s": response.wall_s,
        "sensor": response.sensor,
        "measure": response.measure,
        "curves": [
            {
                "load": curve.level,
                "unit": curve.unit,
                "input": curve.input,
                "branch": curve.branch,
                "folds_hz": curve.folds_hz,
                "peak_hz": curve.peak_hz,
                "peak_m": curve.peak_m,
            }
            for curve in response.curves
        ],
    }


def _forced_validation(context: Context) -> list[dict[str, Any]]:
    keys = (
        "input",
        "load",
        "unit",
        "frequency_hz",
        "sensor",
        "measure",
        "rom_m",
        "fe_m",
        "error_percent",
        "drift_percent",
    )
    points = context.record("forced_validation", ForcedValidation).points
    return [{key: getattr(point, key) for key in keys} for point in points]


def _load_histories(context: Context) -> list[dict[str, Any]]:
    keys = ("name", "input", "unit", "nmte_percent", "rom_peak_m", "fe_peak_m", "range_share")
    histories = context.record("load_histories", LoadHistories).histories
    return [{key: getattr(item, key) for key in keys} for item in histories]


def _backbone(context: Context) -> dict[str, Any]:
    record, forced = context.record("backbone", Backbones), context.study.forced_response
    curve = record.curves[0]
    sensor = curve.sensors.index(forced.sensor) if forced.sensor else 0
    amplitude = curve.amplitude_max if forced.measure == "max" else curve.amplitude_sqrt2_rms
    step = max(1, len(curve.rho) // BACKBONE_POINTS)
    part: dict[str, Any] = {
        "sensor": curve.sensors[sensor],
        "measure": forced.measure,
        "frequency_hz": curve.frequency_hz[::step],
        "amplitude_m": amplitude[::step, sensor],
        "damping_ratio": curve.damping_ratio[::step],
    }
    for band in record.bands[:1]:
        part |= {
            "confidence_level": band.level,
            "frequency_limits_hz": band.frequency_hz[::step],
            "damping_ratio_limits": band.damping_ratio[::step],
        }
    return part


def _export(context: Context) -> dict[str, Any]:
    native = context.record("fmu", Exported).native
    return {"path": Path(native.path).name, "size_bytes": native.size_bytes, "platforms": native.platforms}


def _validation(context: Context) -> dict[str, Any]:
    validation = context.record("validation", Validation)
    check = validation.check
    part: dict[str, Any] = {
        "missed_checks": [f"{row.level}: {row.check}" for row in validation.levels.rows if not row.passed],
        "fmpy_problems": len(check.fmpy_problems) + len(check.pythonfmu_problems),
        "native_vs_python_rel": check.native_vs_python_rel,
        "replay_nmte_percent": {replay.name: replay.nmte_percent for replay in validation.replays},
    }
    if check.pythonfmu_vs_python_rel is not None:
        part["pythonfmu_vs_python_rel"] = check.pythonfmu_vs_python_rel
    return part


PARTS: dict[str, tuple[str, Callable[[Context], Any]]] = {
    "preload": ("preload", _preload),
    "modes": ("modes", _modes),
    "ringdowns": ("ringdowns", _ringdowns),
    "learn": ("learn", learning_summary),
    "forcing": ("forcing", forcing_summary),
    "forced_response": ("forced_response", _forced_response),
    "forced_validation": ("forced_validation", _forced_validation),
    "load_histories": ("load_histories", _load_histories),
    "backbone": ("backbone", _backbone),
    "fmu": ("fmu", _export),
    "validation": ("fmu", _validation),
}
"""Stage -> key in the summary and the function that fills it."""
