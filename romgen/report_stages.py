"""The last stages: what the run was computed with, and the report."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from romgen.arrays import FloatArray
from romgen.fmu.check import SEED
from romgen.fmu_stages import Exported, Validation
from romgen.forced_curve import ForcedResponse
from romgen.forced_stages import Backbones
from romgen.forced_validation import ForcedValidation
from romgen.forcing_stages import loaded_model
from romgen.jackknife import jackknife_deviation
from romgen.learn import Learned
from romgen.learning_stages import learned
from romgen.load_calibration import Forcing, InputLoad
from romgen.load_histories import LoadHistories
from romgen.model_stages import RingDowns
from romgen.polar_form import polar_text
from romgen.provenance import Provenance, collect_provenance
from romgen.report.inputs import OrderTrial, Reconstruction, ReportInputs, Role, StageCost
from romgen.report.write import ReportFiles, write_report
from romgen.settings import Study, study_warnings
from romgen.stage import Context, Stage, study_key
from romgen.structure import Modes, Preload, Structure
from romgen.trajectory import Trajectory
from romgen.trajectory_error import TrajectoryError

Record = TypeVar("Record")


def report_stages(upstream: tuple[str, ...]) -> tuple[Stage, ...]:
    """Return the stages that look back on all others."""
    return (
        Stage("provenance", Provenance, upstream, tuple(Study.model_fields), collect),
        Stage("report", ReportFiles, ("provenance",), (), write, lambda study: ("report.html",)),
    )


def collect(context: Context) -> Provenance:
    """Record versions, machine, threads, seeds and all settings."""
    study = context.study
    return collect_provenance(study_key(study), study.model_dump_json(), {"input of the FMU check": SEED})


def write(context: Context) -> ReportFiles:
    """Write report.html with its figures, curves and fields."""
    return write_report(report_inputs(context), context.run_dir)


def report_inputs(context: Context) -> ReportInputs:
    """Gather what the report shows from the stages that there are."""
    study, infos, record = context.study, context.infos(), learned(context)
    ringdowns = _optional(context, "ringdowns", RingDowns)
    exported = _optional(context, "fmu", Exported)
    validation = _optional(context, "validation", Validation)
    backbones = _optional(context, "backbone", Backbones)
    forced = _optional(context, "forced_validation", ForcedValidation)
    histories = _optional(context, "load_histories", LoadHistories)
    return ReportInputs(
        study=study.name,
        title=study.report.title,
        structure=_optional(context, "mesh", Structure),
        preload=_optional(context, "preload", Preload),
        modes=_optional(context, "modes", Modes),
        ring_downs=() if ringdowns is None else ringdowns.training + ringdowns.validation,
        reconstructions=reconstructions(context),
        model=loaded_model(context),
        polar_form=polar_text(record.model),
        resonance_reason=record.fit.resonance.reason,
        coefficient_deviation=_deviation(record),
        orders=_orders(record),
        loads=_loads(context),
        forced=_optional(context, "forced_response", ForcedResponse),
        forced_points=() if forced is None else forced.points,
        histories=() if histories is None else histories.histories,
        backbones=() if backbones is None else backbones.curves,
        bands=() if backbones is None else backbones.bands,
        sensor=study.forced_response.sensor,
        measure=study.forced_response.measure,
        fmu_export=None if exported is None else exported.native,
        pythonfmu_export=None if exported is None else exported.pythonfmu,
        fmu_check=None if validation is None else validation.check,
        fmu_levels=None if validation is None else validation.levels,
        fmi3_export=None if exported is None else exported.fmi3,
        fmu_replays={} if validation is None else {item.name: item.nmte_percent for item in validation.replays},
        stages=tuple(StageCost(name, info.wall_s, info.peak_memory_bytes) for name, info in infos.items()),
        warnings=(*study_warnings(study), *(f"{name}: {line}" for name, i in infos.items() for line in i.messages)),
        provenance=context.record("provenance", Provenance),
        vtu=study.report.vtu,
        limits=study.acceptance,
    )


def _loads(context: Context) -> tuple[InputLoad, ...]:
    """The load inputs of recorded data."""
    forcing = _optional(context, "forcing", Forcing)
    return () if forcing is None else forcing.loads


def _deviation(record: Learned) -> FloatArray | None:
    """The jackknife deviation of each normal-form coefficient."""
    replicates = record.fit.replicates
    return None if replicates is None else jackknife_deviation(replicates.normal_form)


def _orders(record: Learned) -> tuple[OrderTrial, ...]:
    """The orders that cross-validation over the training motions tried."""
    table = record.orders
    trials = zip(table.tried.tolist(), table.methods, table.nmte_percent.tolist(), table.stable.tolist(), strict=True)
    best = (table.order, table.method)
    return tuple(OrderTrial(order, error, (order, method) == best, stable) for order, method, error, stable in trials)


def _optional(context: Context, stage: str, cls: type[Record]) -> Record | None:
    return context.record(stage, cls) if stage in context.infos() else None


def reconstructions(context: Context) -> tuple[Reconstruction, ...]:
    """Return every trajectory beside what the model makes of its start."""
    record = learned(context)
    sensors = record.model.sensors

    def pairs(errors: Iterable[TrajectoryError], role: Role) -> list[Reconstruction]:
        return [
            Reconstruction(Trajectory(e.name, e.t, sensors, e.displacement), e.predicted, e.nmte_percent, role)
            for e in errors
        ]

    return (*pairs(record.training, "training"), *pairs(record.validation, "validation"))
