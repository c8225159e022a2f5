"""romgen sweep: several studies at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet
from romgen.cli.output import Output
from romgen.executor import executor_for
from romgen.sweep import SweepResult
from romgen.sweep import sweep as run_sweep


@reported
def sweep(
    studies: Annotated[list[Path], typer.Argument(metavar="STUDY...", help="Study files; `extends` keeps them short.")],
    root: Annotated[Path, typer.Option("--root", help="Folder of the run folders.")] = Path("runs"),
    executor: Annotated[
        str, typer.Option("--executor", help="serial, processes, processes:4, or a Dask address tcp://host:8786.")
    ] = "processes",
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run several studies as independent jobs and print their headlines side by side."""
    out = Output(quiet=quiet, as_json=json_output)
    files = [path / "study.toml" if path.is_dir() else path for path in studies]
    results = run_sweep(files, root, executor_for(executor))
    width = max(len(result.study) for result in results)
    out.text(f"{'study':<{width}}  {'f1 Hz':>9}  {'f2 Hz':>9}  {'validation NMTE %':>17}")
    for result in results:
        out.text(f"{result.study:<{width}}  {_headline(result)}")
    out.document({result.study: result.summary or {"error": result.error} for result in results})
    worst = max(result.exit_code for result in results)
    if worst:
        raise typer.Exit(worst)


def _headline(result: SweepResult) -> str:
    if result.summary is None:
        return result.error
    learned: dict[str, Any] = result.summary["learn"]
    hertz = [pair[1] / 6.283185307179586 for pair in learned["eigenvalues_per_s"]]
    shown = "  ".join(f"{value:>9.3f}" for value in [*hertz, float("nan")][:2])
    held_out = [error for error in learned["nmte_percent"]["validation"].values() if error is not None]
    return f"{shown}  {max(held_out):>17.3f}" if held_out else shown
