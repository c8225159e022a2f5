"""romgen report: write the report again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date


@reported
def report(study_path: StudyPath, run_dir: RunDir = None, json_output: Json = False, quiet: Quiet = False) -> None:
    """Bring all stages up to date and write report.html, figures, curves and fields again."""
    study, out = open_study(study_path), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    with _set_aside(folder / "report.html"):
        bring_up_to_date(study, folder, out, until=None, force=False)
    out.text(f"report   {folder / 'report.html'}")
    out.document({"report": str(folder / "report.html")})


@contextmanager
def _set_aside(file: Path) -> Iterator[None]:
    """Take a file out of the way, and put it back where the block does not write a new one."""
    aside = file.with_name(f"{file.name}.before")
    if file.is_file():
        file.replace(aside)
    try:
        yield
    finally:
        if aside.is_file() and not file.is_file():
            aside.replace(file)
        aside.unlink(missing_ok=True)
