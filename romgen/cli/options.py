"""Arguments and options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from romgen.settings import Study, load_study

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY", help="A study.toml, or the folder that holds it.")]
RunDir = Annotated[Path | None, typer.Option("--run-dir", help="Where results go; default runs/<name of the study>.")]
Force = Annotated[bool, typer.Option("--force", help="Compute also what is stored.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print errors only.")]


def open_study(path: Path) -> Study:
    """Load the study of a file or of a folder with a study.toml."""
    return load_study(path / "study.toml" if path.is_dir() else path)


def run_folder(study: Study, run_dir: Path | None) -> Path:
    """Return the chosen run folder, or runs/<name> below the current folder."""
    return run_dir if run_dir is not None else Path("runs") / study.name
