"""romgen report: write the report again."""

from __future__ import annotations

from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date


@reported
def report(study_path: StudyPath, run_dir: RunDir = None, json_output: Json = False, quiet: Quiet = False) -> None:
    """Bring all stages up to date and write report.html, figures, curves and fields again."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    (folder / "report.html").unlink(missing_ok=True)
    bring_up_to_date(study, folder, out, until=None, force=False)
    out.text(f"report   {folder / 'report.html'}")
    out.document({"report": str(folder / "report.html")})
