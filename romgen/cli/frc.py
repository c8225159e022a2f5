"""romgen frc: frequency responses and backbone of the reduced model."""

from __future__ import annotations

from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary
from romgen.errors import InputError


@reported
def frc(
    study_path: StudyPath,
    run_dir: RunDir = None,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run up to the frequency responses and the backbone; print peaks and folds."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    if not study.forced_response.levels:
        raise InputError("names no levels", where="[forced_response]", advice="add levels = [2.0, 4.0]")
    folder = run_folder(study, run_dir)
    bring_up_to_date(study, folder, out, until="backbone", force=force)
    summary = read_summary(folder)
    part = summary["forced_response"]
    rows = [
        (
            f"{curve['load']:g} {curve['unit']}",
            str(curve["branch"]),
            f"{curve['peak_hz']:.3f}",
            f"{1e3 * curve['peak_m']:.4f}",
            ", ".join(f"{fold:.3f}" for fold in curve["folds_hz"]) or "none",
        )
        for curve in part["curves"]
    ]
    out.table(("level", "branch", "peak Hz", f"peak mm ({part['sensor']}, {part['measure']})", "folds Hz"), rows)
    out.document({"forced_response": part, "backbone": summary["backbone"]})
