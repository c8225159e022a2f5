"""The stages from the reduced model to a checked FMU."""

from __future__ import annotations

import logging
import math
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

from romgen.arrays import FloatArray
from romgen.fmu.check import check_fmu
from romgen.fmu.driver import replay
from romgen.fmu.export import export_fmu
from romgen.fmu.export3 import export_fmi3
from romgen.fmu.levels import validate_unit
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuCheck, FmuExport, FmuInfo, FmuLevels
from romgen.fmu.reference_files import write_reference_files
from romgen.forcing_stages import loaded_model, model_upstream
from romgen.learning_stages import learned
from romgen.load_calibration import Forcing
from romgen.metrics import nmte_percent
from romgen.progress import Report
from romgen.settings import Study
from romgen.stage import Context, Stage
from romgen.trajectory_error import TrajectoryError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Exported:
    """The exported units; ``pythonfmu`` and ``fmi3`` are None where the study does not ask for them."""

    native: FmuExport
    pythonfmu: FmuExport | None
    fmi3: FmuExport | None


@dataclass(frozen=True)
class Replay:
    """One held-out motion rebuilt by the native unit from its start state.

    Attributes
    ----------
    name : of the trajectory.
    displacement : (n_time, n_sensor) m, sensors of the unit.
    nmte_percent : against the recorded sensor displacement.
    """

    name: str
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    nmte_percent: float


@dataclass(frozen=True)
class Validation:
    """What the exported units are worth: conformity and equality with the Python model, replay of held-out motions."""

    check: FmuCheck
    replays: tuple[Replay, ...]
    levels: FmuLevels


def fmu_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stages for export and check."""
    return (
        Stage("fmu", Exported, model_upstream(study), ("study", "forced_response", "fmu"), export, _unit_names),
        Stage("validation", Validation, (*model_upstream(study), "fmu"), (), validate),
    )


def _unit_names(study: Study) -> tuple[str, ...]:
    wanted = ((True, ""), (study.fmu.pythonfmu, "_pythonfmu"), (study.fmu.fmi3, "_fmi3"))
    return tuple(f"{study.name}{suffix}.fmu" for asked, suffix in wanted if asked)


def _path(context: Context, suffix: str) -> Path:
    return context.run_dir / f"{context.study.name}{suffix}.fmu"


def export(context: Context) -> Exported:
    """Write the native unit and, if asked for, the pythonfmu one."""
    study, model = context.study, loaded_model(context)
    errors = tuple((e.name, e.nmte_percent) for e in learned(context).validation)
    info = FmuInfo(
        origin=(f"study {study.name}", f"inputs sha256 {context.key}", *_load_sources(context)),
        errors_percent=errors,
        base_share=_base_share(study),
        input_range=_input_range(study, model.inputs),
        picture=None if study.fmu.icon is None else study.fmu.icon.read_bytes(),
    )
    share = 0.5 if study.fmu.fmi3 else 1.0
    native = export_fmu(model, _path(context, ""), study.fmu, info=info, report=_part(context.report, 0.0, share))
    for note in (*native.notes, *_absolute_notes(study)):
        log.warning("%s", note)
    python = (
        export_pythonfmu(model, _path(context, "_pythonfmu"), study.fmu, info=info) if study.fmu.pythonfmu else None
    )
    array_unit = None
    if study.fmu.fmi3:
        report = _part(context.report, share, 1.0)
        array_unit = export_fmi3(model, _path(context, "_fmi3"), study.fmu, info=info, report=report)
    return Exported(native, python, array_unit)


def _absolute_notes(study: Study) -> tuple[str, ...]:
    """Recorded data do not say which way their sensors look."""
    if study.data is None or not study.fmu.absolute:
        return ()
    return ("absolute outputs add the motion of the base to every sensor: sensors across it are wrong",)


def _load_sources(context: Context) -> tuple[str, ...]:
    """What the loads of recorded data rest on: whoever gets the unit has no report."""
    loads = context.record("forcing", Forcing).loads if context.study.forcing else ()
    return tuple(note for load in loads for note in load.notes)


def _part(report: Report, start: float, end: float) -> Report:
    """Report the progress of one part of the work as that of the whole."""

    def told(fraction: float, text: str) -> None:
        report(start + (end - start) * fraction, text)

    return told


def _base_share(study: Study) -> tuple[float, ...]:
    """1 for each sensor along the motion of the base, 0 for one across it; () where no base moves."""
    base = study.base_acceleration
    if base is None:
        return ()
    return tuple(float(sensor.direction == base.direction) for sensor in study.sensors.values())


def _input_range(study: Study, inputs: tuple[str, ...]) -> tuple[tuple[float, float], ...]:
    """Ranges given in the study, else as far as the forced response goes; () unless every input has one."""
    forced = study.forced_response
    highest = max((abs(level) for level in forced.levels), default=0.0)
    computed = {forced.input: (-highest, highest)} if highest > 0.0 else {}
    known = {**computed, **study.fmu.input_range}
    return tuple(known[name] for name in inputs) if set(inputs) <= set(known) else ()


def validate(context: Context) -> Validation:
    """Check the units with fmpy against the Python model, and replay the held-out motions."""
    if context.study.fmu.start == "state":
        write_reference_files(_path(context, ""), context.run_dir / "fmu_reference")
        return _validate(context, _path(context, ""))
    # Motions are replayed from states; a unit that starts from sensors is checked through a twin without that.
    with tempfile.TemporaryDirectory(prefix="romgen_twin_") as folder:
        twin = Path(folder) / "twin.fmu"
        settings = context.study.fmu.model_copy(update={"start": "state", "platforms": ("host",)})
        export_fmu(loaded_model(context), twin, settings, info=FmuInfo(base_share=_base_share(context.study)))
        return _validate(context, twin)


def _validate(context: Context, unit: Path) -> Validation:
    record = learned(context)
    # The free run starts where a training motion starts: any mixture of trained amplitudes may lie outside the data.
    starts = [item.start for item in record.training if math.isfinite(item.nmte_percent)]
    check = check_fmu(
        unit,
        loaded_model(context),
        context.study.fmu,
        pythonfmu=_path(context, "_pythonfmu") if context.study.fmu.pythonfmu else None,
        z0=starts[0] if starts else None,
    )
    context.report(0.5, "replay")
    # a motion on which the model itself diverges has nothing to replay
    motions = [item for item in learned(context).validation if math.isfinite(item.nmte_percent)]
    replays = tuple(_replay(context, item, unit) for item in motions)
    context.report(0.8, "levels L0 to L3")
    levels = validate_unit(unit)
    if context.study.fmu.fmi3:
        context.report(0.9, "levels L0 to L3, FMI 3.0")
        levels = with_fmi3(levels, validate_unit(_path(context, "_fmi3")))
    for row in levels.rows:
        if not row.passed:
            log.warning("FMU, %s: %s: %.3g, limit %g +- %g", row.level, row.check, row.value, row.target, row.limit)
    return Validation(check, replays, levels)


def with_fmi3(levels: FmuLevels, more: FmuLevels) -> FmuLevels:
    """The levels of a unit of FMI 2.0 followed by those of its FMI 3.0 twin, whose names say so."""
    rows = tuple(replace(row, level=f"{row.level} FMI 3.0") for row in more.rows)
    problems = tuple(f"FMI 3.0: {problem}" for problem in more.problems)
    notes = tuple(f"FMI 3.0: {note}" for note in more.notes if note not in levels.notes)
    return FmuLevels((*levels.rows, *rows), (*levels.problems, *problems), (*levels.notes, *notes))


def _replay(context: Context, motion: TrajectoryError, unit: Path) -> Replay:
    """Rebuild a held-out motion from the start state that its first window gave."""
    run = replay(unit, motion.t, motion.start)
    sensors = learned(context).model.sensors
    columns = [sensors.index(sensor) for sensor in context.study.fmu.sensors or sensors]
    return Replay(motion.name, run.displacement, nmte_percent(motion.displacement[:, columns], run.displacement))
