"""romgen export: the FMU of a study."""

from __future__ import annotations

from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary


@reported
def export(
    study_path: StudyPath,
    run_dir: RunDir = None,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run up to the FMU and say where it is."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    bring_up_to_date(study, folder, out, until="fmu", force=force)
    part = read_summary(folder)["fmu"]
    out.text(f"{folder / part['path']}  {part['size_bytes'] / 1e3:.0f} kB, {', '.join(part['platforms']) or 'sources'}")
    out.document(part)
