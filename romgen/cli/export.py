"""romgen export: the FMU of a study."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from romgen.cli.failures import reported
from romgen.cli.options import Force, Json, Quiet, RunDir, StudyPath, open_study, run_folder
from romgen.cli.output import Output
from romgen.cli.run import bring_up_to_date, read_summary
from romgen.errors import InputError
from romgen.settings import Study


class Backend(StrEnum):
    """What runs inside a unit."""

    C = "c"
    PYTHON = "python"


Backends = Annotated[
    Backend | None,
    typer.Option(
        "--backend", help="c: the native unit alone; python: the pythonfmu unit too; default: as in the study."
    ),
]
Sensors = Annotated[
    str | None, typer.Option("--sensors", metavar="A,B", help="Sensors shown as outputs, for this export only.")
]


@reported
def export(
    study_path: StudyPath,
    backend: Backends = None,
    sensors: Sensors = None,
    run_dir: RunDir = None,
    *,
    force: Force = False,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run up to the FMU and say where it is; what was learned is kept when the options differ."""
    study, out = _with_options(open_study(study_path), backend, sensors), Output(quiet=quiet, as_json=json_output)
    folder = run_folder(study, run_dir)
    bring_up_to_date(study, folder, out, until="fmu", force=force)
    part = read_summary(folder)["fmu"]
    out.text(f"{folder / part['path']}  {part['size_bytes'] / 1e3:.0f} kB, {', '.join(part['platforms']) or 'sources'}")
    if study.fmu.pythonfmu:
        out.text(f"{folder / study.name}_pythonfmu.fmu  needs Python with numpy")
    out.document(part)


def _with_options(study: Study, backend: Backend | None, sensors: str | None) -> Study:
    """The study with the backend and the sensors of the command line in place of its own.

    Raises
    ------
    InputError : for a sensor that the study does not have.
    """
    changes: dict[str, object] = {}
    if backend is not None:
        changes["pythonfmu"] = backend is Backend.PYTHON
    if sensors is not None:
        names = tuple(name.strip() for name in sensors.split(",") if name.strip())
        unknown = [name for name in names if name not in study.sensor_names]
        if unknown or not names:
            advice = f"choose from {', '.join(study.sensor_names)}"
            value = unknown[0] if unknown else "an empty list"
            raise InputError("unknown sensor", where="--sensors", value=value, advice=advice)
        changes["sensors"] = names
    return study.model_copy(update={"fmu": study.fmu.model_copy(update=changes)})
