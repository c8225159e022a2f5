"""romgen learn: trajectories and the reduced model learned from them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary, stability_line
from romgen.fmu.model_file import model_json
from romgen.forcing_stages import last_model_stage
from romgen.pipeline import reduced_model
from romgen.polar_form import polar_text
from romgen.store import replace_atomically

ModelJson = Annotated[Path | None, typer.Option("--model-json", help="Write the reduced model as a JSON file.")]


@reported
def learn(
    study_path: StudyPath,
    run_dir: RunDir = None,
    force: Force = False,
    model_file: ModelJson = None,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run up to the reduced model; print its errors and its polar form."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    result = bring_up_to_date(study, folder, out, until=last_model_stage(study), force=force)
    part = read_summary(folder)["learn"]
    rows = [
        (name, role, f"{error:.3f}") for role, errors in part["nmte_percent"].items() for name, error in errors.items()
    ]
    out.table(("trajectory", "role", "NMTE %"), rows)
    model = reduced_model(result)
    out.text(stability_line(part))
    out.text(polar_text(model))
    if model_file is not None:
        replace_atomically(model_file, lambda path: _write(path, model_json(model)))
    out.document(part)


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
