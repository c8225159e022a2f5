"""The learning stage: from the trajectories of a study to its reduced model."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from romgen.learn import Learned, Loads, learn
from romgen.model_stages import recorded
from romgen.reduced_dynamics import LinearPart
from romgen.reduced_model import ReducedModel
from romgen.settings import Study
from romgen.stage import Context, Stage
from romgen.structure import Modes
from romgen.trajectory_error import TrajectoryError

log = logging.getLogger(__name__)


def learning_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stage; with a finite-element model its modes give the loads."""
    upstream = ("data",) if study.data is not None else ("modes", "ringdowns")
    return (Stage("learn", Learned, upstream, ("study.name", "learn"), learn_model),)


def learn_model(context: Context) -> Learned:
    """Learn from the training trajectories; judge by the validation ones."""
    study, trajectories = context.study, recorded(context)
    learned = learn(
        trajectories.training, trajectories.validation, study.learn, study.name, _loads(context), _linear(context)
    )
    log.info("%s", learned.choice)
    for note in (*learned.notes, *_unjudged(learned, study)):
        log.warning("%s", note)
    return learned


def _unjudged(learned: Learned, study: Study) -> tuple[str, ...]:
    """Say what [acceptance] does not judge for lack of data."""
    if learned.validation:
        return ()
    return (
        "no validation trajectory: all errors are those of training motions, and [acceptance] nmte_percent = "
        f"{study.acceptance.nmte_percent:g} judges nothing of the learning",
    )


def _loads(context: Context) -> Loads | None:
    """Return the loads on the master modes; recorded data have none."""
    if context.study.data is not None:
        return None
    modes = context.record("modes", Modes)
    rows = [mode - 1 for mode in context.study.learn.master_modes]
    return Loads(modes.inputs, modes.input_units, modes.modal_load[rows]) if modes.inputs else None


def _linear(context: Context) -> LinearPart | None:
    """Return frequency and damping of the master modes, or None where they are fitted."""
    if context.study.data is not None or context.study.learn.linear_part == "fitted":
        return None
    modes = context.record("modes", Modes)
    rows = [mode - 1 for mode in context.study.learn.master_modes]
    return LinearPart(2.0 * np.pi * modes.frequency_hz[rows], modes.damping_ratio[rows])


def learned(context: Context) -> Learned:
    """Return the record of the stage."""
    return context.record("learn", Learned)


def learned_model(context: Context) -> ReducedModel:
    """Return the reduced model."""
    return learned(context).model


def _distance(model: ReducedModel, error: TrajectoryError) -> float:
    return float(model.trained_range.distance(error.start[None])[0])


def _stability(model: ReducedModel) -> dict[str, Any]:
    tried = model.stability
    if tried is None:
        return {}
    part = {
        "stable": tried.is_stable,
        "reach": tried.reach,
        "factor": tried.factor,
        "decaying_share": tried.share,
        "slowest_rate_per_s": tried.slowest_rate,
        "linear_rate_per_s": tried.linear_rate,
        "starts": tried.starts,
    }
    return {"stability": part}


def learning_summary(context: Context) -> dict[str, Any]:
    """Return the part "learn" of summary.json."""
    record = learned(context)
    roles = {"training": record.training, "validation": record.validation}
    return {
        "order": record.order,
        "dimension": 2 * len(record.model.eigenvalues),
        "eigenvalues_per_s": record.model.eigenvalues,
        "internal_resonance": record.model.internal_resonance,
        "trained_amplitude": record.model.trained_amplitude,
        "trained_facets": record.model.trained_range.facets,
        **_stability(record.model),
        "nmte_percent": {role: {e.name: e.nmte_percent for e in errors} for role, errors in roles.items()},
        "sensor_nmte_percent": {
            role: {e.name: e.sensor_nmte_percent for e in errors} for role, errors in roles.items()
        },
        "first_sample_nmte_percent": {
            role: {e.name: e.first_sample_percent for e in errors} for role, errors in roles.items()
        },
        "rest_percent": {role: {e.name: e.rest_percent for e in errors} for role, errors in roles.items()},
        "nmte_about_rest_percent": {
            role: {e.name: e.about_rest_percent for e in errors} for role, errors in roles.items()
        },
        "static_percent": {role: {e.name: e.static_percent for e in errors} for role, errors in roles.items()},
        "diverged_s": {role: {e.name: e.diverged_s for e in errors} for role, errors in roles.items()},
        "start_distance": {
            role: {e.name: _distance(record.model, e) for e in errors} for role, errors in roles.items()
        },
    }
