"""romgen check: everything that can be wrong with a study, before anything is computed."""

from __future__ import annotations

import importlib.util
from dataclasses import asdict

from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet, StudyPath, open_study
from romgen.cli.output import Output
from romgen.model_stages import finite_elements, share_out
from romgen.settings import Study, StudyError, estimate, study_warnings


@reported
def check(study_path: StudyPath, json_output: Json = False, quiet: Quiet = False) -> None:
    """Check a study: keys, values, names, files, units; then estimate its memory and run time."""
    study = open_study(study_path)
    if study.data is not None:
        share_out(study.data)
    out = Output(quiet=quiet, as_json=json_output)
    warnings, size = study_warnings(study) + _missing(study), estimate(study, _open_meshes(study))
    for warning in warnings:
        out.text(f"warning: {warning}")
    out.text(describe(study))
    if size is not None:
        memory, minutes = size.memory_bytes / 1e9, size.wall_s / 60.0
        out.text(f"{size.dofs} displacement unknowns")
        out.text(f"ring-downs need about {memory:.1f} GB and {minutes:.0f} min, within a factor of three")
    out.text("no problem found")
    sizes = None if size is None else asdict(size)
    out.document({"study": study.name, "problems": [], "warnings": warnings, "estimate": sizes})


def _open_meshes(study: Study) -> int:
    """Open the mesh files of a study and return the number of their nodes.

    Raises
    ------
    StudyError : files that cannot be used, and names that they do not have.
    """
    if not (study.meshes or study.regions) or _missing(study):
        return 0
    problems, nodes = finite_elements("fe_stages").mesh_file_problems(study)
    if problems:
        raise StudyError(problems)
    return int(nodes)


def _missing(study: Study) -> tuple[str, ...]:
    """Say what this machine lacks to run the study."""
    if study.bodies and importlib.util.find_spec("skfem") is None:
        return ("this machine cannot run the study: scikit-fem is not installed; pip install 'romgen[fem]'",)
    return ()


def describe(study: Study) -> str:
    """Say in one line what the study consists of."""
    if study.data is not None:
        data = study.data
        return (
            f"{study.name}: {len(data.files)} files, {len(data.sensors)} sensors, {len(data.training)} training and "
            f"{len(data.validation)} validation trajectories, load inputs: {', '.join(study.load_inputs) or 'none'}"
        )
    ringdowns = study.ringdowns
    training, validation = (len(ringdowns.training), len(ringdowns.validation)) if ringdowns else (0, 0)
    return (
        f"{study.name}: {_bodies(study)}, {len(study.contacts)} contact pairs, {len(study.sensors)} sensors, "
        f"{training} training and {validation} validation ring-downs"
    )


def _bodies(study: Study) -> str:
    parts = [f"{len(study.blocks)} blocks"] if study.blocks else []
    return ", ".join([*parts, f"{len(study.meshes)} mesh files"] if study.meshes else parts)
