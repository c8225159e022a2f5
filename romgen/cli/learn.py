"""romgen learn: trajectories and the reduced model learned from them."""

from __future__ import annotations

from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary
from romgen.pipeline import reduced_model
from romgen.polar_form import polar_text


@reported
def learn(
    study_path: StudyPath,
    run_dir: RunDir = None,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run up to the reduced model; print its errors and its polar form."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    result = bring_up_to_date(study, folder, out, until="learn", force=force)
    part = read_summary(folder)["learn"]
    rows = [
        (name, role, f"{error:.3f}") for role, errors in part["nmte_percent"].items() for name, error in errors.items()
    ]
    out.table(("trajectory", "role", "NMTE %"), rows)
    out.text(polar_text(reduced_model(result)))
    out.document(part)
