"""Several studies as independent jobs of one executor: parameter sweeps, mesh or step studies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from romgen.errors import InputError, RomgenError, system_error
from romgen.executor import Executor
from romgen.pipeline import run
from romgen.settings import load_study


@dataclass(frozen=True)
class SweepJob:
    """A study file and the folder that its run goes to, as text so that any worker can take it."""

    study: str
    run_dir: str


@dataclass(frozen=True)
class SweepResult:
    """What became of one study: its summary, or the line that says why there is none."""

    study: str
    run_dir: str
    summary: dict[str, Any] | None
    error: str
    exit_code: int


def run_job(job: SweepJob) -> SweepResult:
    """Bring one study up to date; a failure is a result, so that it does not end the others."""
    try:
        run(load_study(Path(job.study)), Path(job.run_dir))
    except (RomgenError, OSError) as error:
        told = system_error(error) if isinstance(error, OSError) else error
        return SweepResult(job.study, job.run_dir, None, str(told), told.exit_code)
    summary = json.loads((Path(job.run_dir) / "summary.json").read_text(encoding="utf-8"))
    return SweepResult(job.study, job.run_dir, summary, "", 0)


def sweep(studies: Sequence[Path], root: Path, executor: Executor) -> tuple[SweepResult, ...]:
    """Run studies as jobs of an executor, each in ``root/<name of the study>``, in the order given.

    All study files are checked before anything is computed; two studies of one name raise ``InputError``.
    """
    names = [load_study(path).name for path in studies]
    if len(set(names)) < len(names):
        raise InputError("two studies have the same name", where="sweep", value=", ".join(names))
    jobs = [SweepJob(str(path), str(root / name)) for path, name in zip(studies, names, strict=True)]
    return executor.map(run_job, jobs)
