"""The stage that gives a model of recorded data its load inputs, and the model with all inputs."""

from __future__ import annotations

import logging
from typing import Any

from romgen.learning_stages import learned_model
from romgen.load_calibration import CalibratedPoint, Forcing, calibrate_forcing
from romgen.reduced_model import ReducedModel
from romgen.settings import Study
from romgen.stage import Context, Stage

log = logging.getLogger(__name__)


def forcing_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stage; a finite-element model knows its loads, and data without [forcing] have none."""
    if not study.forcing:
        return ()
    return (Stage("forcing", Forcing, ("learn",), ("forcing", "forced_response.measure"), calibrate),)


def model_upstream(study: Study) -> tuple[str, ...]:
    """Return the stages whose records make the model with its inputs."""
    return ("learn", "forcing") if study.forcing else ("learn",)


def last_model_stage(study: Study) -> str:
    """Return the stage after which the model has its inputs."""
    return model_upstream(study)[-1]


def calibrate(context: Context) -> Forcing:
    """Find the loads of all inputs of the study."""
    study = context.study
    forcing = calibrate_forcing(learned_model(context), study.forcing, study.forced_response.measure)
    for load in forcing.loads:
        for note in load.notes:
            log.warning("%s", note)
    return forcing


def loaded_model(context: Context) -> ReducedModel:
    """Return the reduced model with its load inputs."""
    model = learned_model(context)
    return context.record("forcing", Forcing).applied(model) if context.study.forcing else model


def forcing_summary(context: Context) -> dict[str, Any]:
    """Return the part "forcing" of summary.json."""
    return {
        load.input: {
            "unit": load.unit,
            "source": load.source,
            "modal_load": load.modal_load,
            "deviation_percent": load.deviation_percent,
            "spread_percent": load.spread_percent,
            "points": [_point(point) for point in load.points],
        }
        for load in context.record("forcing", Forcing).loads
    }


def _point(point: CalibratedPoint) -> dict[str, Any]:
    keys = (
        "level",
        "frequency_hz",
        "peak",
        "resonance_hz",
        "sensor",
        "measure",
        "measured_m",
        "model_m",
        "level_needed",
        "deviation_percent",
        "expected_percent",
        "input_change_percent",
        "mode",
        "distance",
        "stable",
    )
    return {key: getattr(point, key) for key in keys}
