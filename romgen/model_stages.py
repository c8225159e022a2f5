"""The stages that make trajectories: a finite-element model marched in time, or files that were recorded elsewhere."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from types import ModuleType

from romgen.errors import InputError
from romgen.settings import DataSettings, RingDownSettings, Study
from romgen.stage import Context, Stage
from romgen.structure import Modes, Preload, RingDown, Structure
from romgen.trajectory import Trajectory
from romgen.trajectory_files import read_trajectories

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RingDowns:
    """The computed free decays.

    Attributes
    ----------
    training, validation : in the order of the study.
    """

    training: tuple[RingDown, ...]
    validation: tuple[RingDown, ...]


@dataclass(frozen=True)
class Recorded:
    """The trajectories of a study.

    Attributes
    ----------
    training, validation : in the order of the study.
    """

    training: tuple[Trajectory, ...]
    validation: tuple[Trajectory, ...]


def model_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stages up to the trajectories, for a study with a model or with data."""
    if study.data is not None:
        return (Stage("data", Recorded, (), ("data",), read_data),)
    return (
        Stage("mesh", Structure, (), ("materials", "blocks", "contacts", "constraints"), build_mesh),
        Stage("preload", Preload, ("mesh",), ("loads", "preload"), solve_preload),
        Stage("modes", Modes, ("preload",), ("modes", "sensors", "base_acceleration"), solve_modes),
        Stage("ringdowns", RingDowns, ("modes",), ("ringdowns", "learn.master_modes"), march_ringdowns),
    )


def recorded(context: Context) -> Recorded:
    """Return the trajectories of the study, wherever they come from."""
    if context.study.data is not None:
        return context.record("data", Recorded)
    ringdowns = context.record("ringdowns", RingDowns)
    return Recorded(
        tuple(item.trajectory for item in ringdowns.training), tuple(item.trajectory for item in ringdowns.validation)
    )


def build_mesh(context: Context) -> Structure:
    """Mesh the bodies and find the contact pairs."""
    structure: Structure = _finite_elements().structure(context.study)
    return structure


def solve_preload(context: Context) -> Preload:
    """Find the static equilibrium under the clamping loads."""
    preload: Preload = _finite_elements().solve_preload(context.study, context.report)
    return preload


def solve_modes(context: Context) -> Modes:
    """Find the modes about the preloaded state."""
    modes: Modes = _finite_elements().solve_modes(context.study, context.record("preload", Preload))
    return modes


def march_ringdowns(context: Context) -> RingDowns:
    """March all ring-downs together, from the last finished segment on, and join the segments."""
    fe, study, settings = _finite_elements(), context.study, _ringdown_settings(context.study)
    preload, modes = context.record("preload", Preload), context.record("modes", Modes)
    segments = context.segments()
    if len(segments):
        log.warning("continued after %d finished segments; wall time and memory are those of the rest", len(segments))
    _tell(context, settings, len(segments))
    for segment in fe.march_ringdowns(study, preload, modes, segments.last(fe.RingDownSegment)):
        segments.append(segment)
        _tell(context, settings, len(segments))
    joined = fe.join_ringdowns(segments.load_all(fe.RingDownSegment), study, modes)
    count = len(settings.training)
    return RingDowns(joined[:count], joined[count:])


def _tell(context: Context, settings: RingDownSettings, finished: int) -> None:
    """Report how far the march is."""
    steps = min(finished * settings.segment_steps, settings.steps)
    context.report(steps / settings.steps, f"{steps * settings.time_step:.3f} of {settings.duration:.3f} s")


def _ringdown_settings(study: Study) -> RingDownSettings:
    if study.ringdowns is None:
        raise InputError("the study has no ring-downs", where="[ringdowns]")
    return study.ringdowns


def _finite_elements() -> ModuleType:
    """Import the finite-element half, which a study from data does without."""
    try:
        from romgen import fe_stages
    except ImportError as error:
        raise InputError(
            "a study with [blocks] needs the finite-element half", value=str(error), advice="pip install 'romgen[fem]'"
        ) from error
    return fe_stages


def read_data(context: Context) -> Recorded:
    """Read the files of [data] and share the trajectories out to training and validation."""
    data = context.study.data
    if data is None:
        raise InputError("the study has no data", where="[data]")
    trajectories = read_trajectories(data.files, data.sensors, data.unit)
    return Recorded(_chosen(trajectories, data.training, data), _chosen(trajectories, data.validation, data))


def _chosen(
    trajectories: tuple[Trajectory, ...], wanted: tuple[int | str, ...], data: DataSettings
) -> tuple[Trajectory, ...]:
    """Return trajectories by index or name.

    Raises
    ------
    InputError : there is no such trajectory.
    """
    by_name: dict[int | str, Trajectory] = {item.name: item for item in trajectories}
    by_name |= dict(enumerate(trajectories))
    for key in wanted:
        if key not in by_name:
            names = ", ".join(item.name for item in trajectories)
            raise InputError(
                "no such trajectory in the files",
                where="[data] training, validation",
                value=key,
                advice=f"use 0 to {len(trajectories) - 1} or {names}",
            )
    return tuple(by_name[key] for key in wanted)
