"""romgen validate: the numbers of a study, or a single FMU, against their limits."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from romgen.acceptance import verdicts
from romgen.cli.failures import failure, reported
from romgen.cli.options import Force, Json, Quiet, RunDir, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary
from romgen.errors import AcceptanceError, InputError
from romgen.fmu.levels import validate_unit


@reported
def validate(
    target: Annotated[Path, typer.Argument(metavar="STUDY_OR_FMU", help="A study.toml, its folder, or an FMU.")],
    run_dir: RunDir = None,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Check held-out errors, preload and FMU against [acceptance]; exit code 4 where a limit is missed."""
    out = Output(quiet=quiet, as_json=json_output)
    if target.suffix.lower() == ".fmu":
        _validate_unit(target, out)
        return
    study = open_study(target)
    folder = run_folder(study, run_dir)
    bring_up_to_date(study, folder, out, until="validation", force=force)
    judged = verdicts(read_summary(folder), study.acceptance)
    rows = [(v.name, f"{v.value:.4g}", f"{v.limit:g}", "ok" if v.passed else "MISSED") for v in judged]
    out.table(("quantity", "value", "limit", ""), rows, numbers=True)
    out.document([{"name": v.name, "value": v.value, "limit": v.limit, "passed": v.passed} for v in judged])
    missed = [v.name for v in judged if not v.passed]
    if missed:
        raise failure([f"{study.name}: limits missed: {', '.join(missed)}"], AcceptanceError.exit_code)


def _validate_unit(path: Path, out: Output) -> None:
    if not path.is_file():
        raise InputError("no such file", where=str(path))
    levels = validate_unit(path)
    for problem in levels.problems:
        out.text(problem)
    rows = [
        (r.level, r.check, f"{r.value:.3g}", f"{r.target:g} +- {r.limit:g}", "ok" if r.passed else "MISSED")
        for r in levels.rows
    ]
    out.table(("level", "check", "value", "limit", ""), rows)
    for note in levels.notes:
        out.text(note)
    out.document({"path": str(path), "problems": levels.problems, "rows": [asdict(r) for r in levels.rows]})
    missed = [r.check for r in levels.rows if not r.passed]
    if missed:
        raise failure([f"{path}: missed: {'; '.join(missed)}"], AcceptanceError.exit_code)
