"""romgen run and the commands that stop earlier."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from romgen.acceptance import verdicts
from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.pipeline import run as run_pipeline
from romgen.runner import RunResult
from romgen.settings import Study, study_warnings


def bring_up_to_date(study: Study, folder: Path, out: Output, *, until: str | None, force: bool) -> RunResult:
    """Run a study up to a stage with progress and warnings on the console."""
    for warning in study_warnings(study):
        out.text(f"warning: {warning}")
    out.text(f"{study.name} in {folder}")
    with out.progress() as progress:
        result = run_pipeline(study, folder, until=until, force=force, progress=progress)
    for message in result.messages:
        out.text(f"  warning: {message}")
    for name in result.computed:
        for message in result.infos[name].messages:
            out.text(f"  {name}: {message}")
    return result


def read_summary(folder: Path) -> dict[str, Any]:
    """Return the content of the run's summary.json."""
    content: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return content


@reported
def run(
    study_path: StudyPath,
    run_dir: RunDir = None,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a study from its model or data to the checked FMU and the report; reuse what is up to date."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    bring_up_to_date(study, folder, out, until=None, force=force)
    summary = read_summary(folder)
    _headlines(summary, out)
    for verdict in verdicts(summary, study.acceptance):
        if not verdict.passed:
            out.text(f"limit missed: {verdict.name} = {verdict.value:.4g} > {verdict.limit:g}")
    out.text(f"FMU      {folder / summary['fmu']['path']}")
    out.text(f"summary  {folder / 'summary.json'}")
    out.text(f"report   {folder / 'report.html'}")
    out.document(summary)


def _headlines(summary: dict[str, Any], out: Output) -> None:
    if "modes" in summary:
        hertz = ", ".join(f"{value:.2f}" for value in summary["modes"]["frequency_hz"])
        out.text(f"modes at {hertz} Hz")
        for pair in summary["modes"].get("near_integer_ratios", [])[:3]:
            first, second = pair["modes"]
            out.text(f"modes {first} and {second} are {pair['detuning_percent']:+.2f} % off {pair['ratio']}")
    for role, errors in summary["learn"]["nmte_percent"].items():
        out.text(f"NMTE {role}: " + ", ".join(f"{name} {value:.2f} %" for name, value in errors.items()))
    out.text(stability_line(summary["learn"]))
    out.text(f"FMU against Python model: {summary['fmu']['native_vs_python_rel']:.1e} relative")


def stability_line(part: dict[str, Any]) -> str:
    """One line on the free decays from the trained range; ``part`` is "learn" of summary.json."""
    tried = part["stability"]
    if not tried["stable"]:
        share = 100.0 * tried["decaying_share"][0]
        return f"not stable in the trained range: {share:.0f} % of {tried['starts']} free motions from there decay"
    reach = f", up to {tried['reach']:g} times of it" if tried["reach"] > 1.0 else ""
    rate = tried["slowest_rate_per_s"][0] / tried["linear_rate_per_s"]
    return (
        f"stable: all {tried['starts']} free motions from the boundary of the trained range decay{reach}, "
        f"at {100 * rate:.0f} % of the linear rate or more"
    )
