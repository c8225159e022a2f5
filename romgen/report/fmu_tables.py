"""The exported unit and its checks as tables."""

from __future__ import annotations

from collections.abc import Mapping

from romgen.fmu.records import FmuCheck, FmuExport, FmuLevels
from romgen.report.blocks import ListingBlock, TableBlock


def export_table(kind: str, export: FmuExport) -> TableBlock:
    """What was written; ``kind`` says which unit, and for which version of FMI."""
    rows = (
        ("file", export.path),
        ("size", f"{export.size_bytes:,} bytes"),
        ("platforms", ", ".join(export.platforms) or "none, source code only"),
        ("compiler", export.compiler),
        ("guid", export.guid),
        ("sha256", export.sha256),
        *(("note", note) for note in export.notes),
    )
    return TableBlock(f"The exported {kind}.", ("what", "value"), rows, True)


def check_table(check: FmuCheck, limit: float) -> TableBlock:
    """Agreement of the units with the Python model under the same input treatment, each against its limit."""
    runs = [
        ("native, free decay", "none", check.native_free_rel, limit),
        ("native, forced", "held constant within each step", check.native_held_rel, limit),
        ("native, forced", "linear within each step (input derivative)", check.native_linear_rel, limit),
    ]
    rows = [(*run[:2], f"{run[2]:.2e}", f"{run[3]:.0e}", "met" if run[2] <= run[3] else "not met") for run in runs]
    if check.pythonfmu_vs_python_rel is not None:
        rows.append(
            ("pythonfmu", "free, and held constant", f"{check.pythonfmu_vs_python_rel:.2e}", "no limit", "cross-check")
        )
    caption = (
        "Units simulated by fmpy against the Python model with the same input treatment: largest difference over "
        f"largest magnitude of states, displacements and velocities over {check.n_step} steps of {check.step_size:g} s."
    )
    return TableBlock(caption, ("run", "input", "difference [1]", "limit [1]", "verdict"), tuple(rows), True)


def levels_table(levels: FmuLevels) -> TableBlock:
    """The validation levels of the native units, each check against its limit."""
    rows = tuple(
        (r.level, r.check, f"{r.value:.3g}", f"{r.target:g} ± {r.limit:g}", "met" if r.passed else "not met")
        for r in levels.rows
    )
    caption = "Validation levels of the native units, as romgen validate prints them. " + " ".join(
        f"{note}." for note in levels.notes
    )
    return TableBlock(caption, ("level", "check", "value", "limit", "verdict"), rows, True)


def replay_table(replays: Mapping[str, float]) -> TableBlock:
    """Held-out motions rebuilt by the native unit."""
    rows = tuple((name, f"{nmte:.3f}") for name, nmte in replays.items())
    caption = "Sensor displacement of the validation motions, rebuilt by the native unit from the start state alone."
    return TableBlock(caption, ("trajectory", "NMTE at the sensors [%]"), rows)


def problem_listing(check: FmuCheck) -> ListingBlock:
    """What the validator of fmpy says about both units."""
    lines = [f"native: {problem}" for problem in check.fmpy_problems] or ["native: no problem"]
    if check.pythonfmu_vs_python_rel is not None:
        lines += [f"pythonfmu: {problem}" for problem in check.pythonfmu_problems] or ["pythonfmu: no problem"]
    return ListingBlock("What fmpy's validator says.", "\n".join(lines))
