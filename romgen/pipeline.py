"""The order of the stages, and the run of a study through them."""

from __future__ import annotations

from pathlib import Path

from romgen.fmu_stages import fmu_stages
from romgen.forced_stages import forced_stages
from romgen.forcing_stages import forcing_stages, loaded_model
from romgen.learning_stages import learned_model, learning_stages
from romgen.model_stages import model_stages
from romgen.progress import RunProgress
from romgen.reduced_model import ReducedModel
from romgen.report_stages import report_stages
from romgen.runner import RunResult, execute
from romgen.settings import Study
from romgen.stage import Stage
from romgen.summary import summarise, write_summary


def stages_of(study: Study) -> tuple[Stage, ...]:
    """Return all stages of a study in their order."""
    model = (*model_stages(study), *learning_stages(study), *forcing_stages(study))
    stages = (*model, *forced_stages(study), *fmu_stages(study))
    return (*stages, *report_stages(tuple(stage.name for stage in stages)))


def run(
    study: Study,
    run_dir: Path,
    *,
    until: str | None = None,
    force: bool = False,
    progress: RunProgress | None = None,
) -> RunResult:
    """Bring a study up to date in its run folder and write summary.json.

    Stored stages are reused while nothing they depend on has changed; a stage that was killed continues after its
    last finished segment.

    Parameters
    ----------
    study : from ``romgen.settings.load_study``.
    run_dir : where result.h5, the FMUs, summary.json and the report go.
    until : name of the last stage to run, default all.
    force : compute also what is stored.
    progress : told about stages and their fractions.

    Raises
    ------
    InputError : the study cannot be computed as given.
    NumericalError : a stage did not reach its tolerance.
    """
    result = execute(stages_of(study), study, run_dir, until=until, force=force, progress=progress)
    write_summary(run_dir / "summary.json", summarise(result))
    return result


def reduced_model(result: RunResult) -> ReducedModel:
    """Return the reduced model of a run that reached the stage "learn"; loads of [forcing] need the stage "forcing"."""
    return loaded_model(result.context) if "forcing" in result.infos else learned_model(result.context)
