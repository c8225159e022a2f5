"""The stages from the reduced model to a checked FMU."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field
from pathlib import Path

from romgen.arrays import FloatArray
from romgen.fmu.check import check_fmu
from romgen.fmu.driver import replay
from romgen.fmu.export import export_fmu
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuCheck, FmuExport, FmuInfo
from romgen.learning_stages import learned, learned_model
from romgen.metrics import nmte_percent
from romgen.settings import Study
from romgen.stage import Context, Stage
from romgen.trajectory_error import TrajectoryError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Exported:
    """The exported units; ``pythonfmu`` is None where the study does not ask for it."""

    native: FmuExport
    pythonfmu: FmuExport | None


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


def fmu_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stages for export and check."""
    return (
        Stage("fmu", Exported, ("learn",), ("study", "fmu"), export, _unit_names),
        Stage("validation", Validation, ("learn", "fmu"), (), validate),
    )


def _unit_names(study: Study) -> tuple[str, ...]:
    return (f"{study.name}.fmu", f"{study.name}_pythonfmu.fmu")[: 2 if study.fmu.pythonfmu else 1]


def export(context: Context) -> Exported:
    """Write the native unit and, if asked for, the pythonfmu one."""
    study, model = context.study, learned_model(context)
    paths = [context.run_dir / name for name in _unit_names(study)]
    errors = tuple((e.name, e.nmte_percent) for e in learned(context).validation)
    info = FmuInfo(origin=(f"study {study.name}", f"inputs sha256 {context.key}"), errors_percent=errors)
    native = export_fmu(model, paths[0], study.fmu, info=info, report=context.report)
    for note in native.notes:
        log.warning("%s", note)
    if not study.fmu.pythonfmu:
        return Exported(native, None)
    return Exported(native, export_pythonfmu(model, paths[1], study.fmu, info=info))


def validate(context: Context) -> Validation:
    """Check the units with fmpy against the Python model, and replay the held-out motions."""
    paths: list[Path] = [context.run_dir / name for name in _unit_names(context.study)]
    record = learned(context)
    # The free run starts where a training motion starts: any mixture of trained amplitudes may lie outside the data.
    starts = [item.start for item in record.training if math.isfinite(item.nmte_percent)]
    check = check_fmu(
        paths[0],
        record.model,
        context.study.fmu,
        pythonfmu=paths[1] if len(paths) > 1 else None,
        z0=starts[0] if starts else None,
    )
    context.report(0.5, "replay")
    # a motion on which the model itself diverges has nothing to replay
    motions = [item for item in learned(context).validation if math.isfinite(item.nmte_percent)]
    return Validation(check, tuple(_replay(context, item, paths[0]) for item in motions))


def _replay(context: Context, motion: TrajectoryError, unit: Path) -> Replay:
    """Rebuild a held-out motion from the start state that its first window gave."""
    run = replay(unit, motion.t, motion.start)
    sensors = learned_model(context).sensors
    columns = [sensors.index(sensor) for sensor in context.study.fmu.sensors or sensors]
    return Replay(motion.name, run.displacement, nmte_percent(motion.displacement[:, columns], run.displacement))
