"""The stages that answer forced questions with the reduced model: frequency responses and backbones."""

from __future__ import annotations

from dataclasses import dataclass

from romgen.backbone import Backbone, backbone
from romgen.confidence_band import ConfidenceBand, confidence_band
from romgen.errors import InputError
from romgen.forced_curve import ForcedResponse
from romgen.forced_response import forced_response
from romgen.forced_validation import ForcedValidation, compare, forced_motion, operating_points
from romgen.forcing_stages import loaded_model, model_upstream
from romgen.learning_stages import learned, learned_model
from romgen.load_histories import LoadHistories, compare_history, history_motion
from romgen.model_stages import finite_elements, march, ringdown_settings
from romgen.settings import Study
from romgen.stage import Context, Stage
from romgen.structure import Modes, Preload


@dataclass(frozen=True)
class Backbones:
    """Backbones of all master modes.

    Attributes
    ----------
    curves : each mode with the others at zero, then those that the others can lock to.
    bands : confidence limits of each curve, () where the coefficients have no replicates.
    """

    curves: tuple[Backbone, ...]
    bands: tuple[ConfidenceBand, ...] = ()


def forced_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stages: without levels there is no forced response, without histories no march under them."""
    histories: tuple[Stage, ...] = ()
    if study.load_histories and study.data is None:
        upstream: tuple[str, ...] = ("preload", "modes", "ringdowns", "learn")
        histories = (
            Stage("load_histories", LoadHistories, upstream, ("ringdowns", "load_histories"), march_histories),
        )
    return (*_harmonic_stages(study), *histories)


def _harmonic_stages(study: Study) -> tuple[Stage, ...]:
    backbones = Stage("backbone", Backbones, ("learn",), (), compute_backbones)
    if not study.forced_response.levels:
        return (backbones,)
    response = Stage("forced_response", ForcedResponse, model_upstream(study), ("forced_response",), compute_response)
    if study.forced_validation is None or study.data is not None:
        return (response, backbones)
    upstream = ("preload", "modes", "ringdowns", "learn", "forced_response")
    tables = ("ringdowns", "forced_validation")
    return (response, backbones, Stage("forced_validation", ForcedValidation, upstream, tables, validate_forced))


def compute_response(context: Context) -> ForcedResponse:
    """Follow the frequency responses at all levels."""
    return forced_response(loaded_model(context), context.study.forced_response)


def validate_forced(context: Context) -> ForcedValidation:
    """March the finite-element model at points of the frequency response, all together, and compare."""
    study, table = context.study, context.study.forced_validation
    record = learned(context)
    if table is None or record.full_field is None:
        raise InputError("needs full fields of the ring-downs", where="[forced_validation]")
    model, response = record.model, context.record("forced_response", ForcedResponse)
    points = operating_points(model, response, table.shares)
    step = ringdown_settings(study).time_step
    motion = forced_motion(model, record.full_field, points, round(table.duration / step))
    preload, modes = context.record("preload", Preload), context.record("modes", Modes)
    fe = finite_elements("fe_transients")
    segments = march(
        context, fe.Segment, lambda last: fe.march_forced(study, preload, modes, motion, last), table.duration
    )
    t, displacement = fe.join_sensors(segments, study)
    column = modes.sensors.index(response.sensor)
    return ForcedValidation(
        tuple(
            compare(model, point, t, displacement[:, column, case], response.sensor, response.measure)
            for case, point in enumerate(points)
        )
    )


def march_histories(context: Context) -> LoadHistories:
    """March the finite-element model under all load histories together, and compare with the reduced model."""
    study, tables = context.study, context.study.load_histories
    model, step = learned_model(context), ringdown_settings(context.study).time_step
    preload, modes = context.record("preload", Preload), context.record("modes", Modes)
    motion = history_motion(tables, len(modes.shapes), step)
    fe = finite_elements("fe_transients")
    segments = march(
        context, fe.Segment, lambda last: fe.march_forced(study, preload, modes, motion, last), motion.n_step * step
    )
    t, displacement = fe.join_sensors(segments, study)
    return LoadHistories(
        tuple(
            compare_history(model, name, table, t, displacement[:, :, case])
            for case, (name, table) in enumerate(tables.items())
        )
    )


def compute_backbones(context: Context) -> Backbones:
    """Follow the backbone of every master mode, and its confidence limits."""
    model, replicates = learned_model(context), learned(context).fit.replicates
    modes = range(len(model.eigenvalues))
    curves = [backbone(model, mode) for mode in modes]
    r = model.internal_resonance
    # The others lock only to a mode whose integer divides all others: in 1:2 to the first mode, not to the second.
    locking = [mode for mode in modes if r and all(other % r[mode] == 0 for other in r)]
    curves += [backbone(model, mode, slaved=True) for mode in locking]
    bands = () if replicates is None else tuple(confidence_band(model, curve, replicates) for curve in curves)
    return Backbones(tuple(curves), bands)
