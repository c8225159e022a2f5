"""The stages that make trajectories: a finite-element model marched in time, or files that were recorded elsewhere."""

from __future__ import annotations

import importlib
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, TypeVar

from romgen.errors import InputError
from romgen.rest_position import counted_from, offset_percent, rest_position
from romgen.settings import DataSettings, RingDownSettings, Study
from romgen.stage import Context, Stage
from romgen.structure import Modes, Preload, RingDown, Structure
from romgen.trajectory import Trajectory
from romgen.trajectory_files import read_trajectories

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Segment = TypeVar("Segment", bound="DataclassInstance")
log = logging.getLogger(__name__)

MODEL_TABLES = (
    "materials",
    "blocks",
    "meshes",
    "regions",
    "contacts",
    "ties",
    "bolts",
    "springs",
    "foundations",
    "point_masses",
    "constraints",
)


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
        Stage("mesh", Structure, (), MODEL_TABLES, build_mesh),
        Stage("preload", Preload, ("mesh",), ("loads", "preload"), solve_preload),
        Stage("modes", Modes, ("preload",), ("modes", "sensors", "base_acceleration", "excitations"), solve_modes),
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
    structure: Structure = finite_elements("fe_stages").structure(context.study)
    return structure


def solve_preload(context: Context) -> Preload:
    """Find the static equilibrium under the clamping loads."""
    preload: Preload = finite_elements("fe_stages").solve_preload(context.study, context.report)
    return preload


def solve_modes(context: Context) -> Modes:
    """Find the modes about the preloaded state."""
    modes: Modes = finite_elements("fe_stages").solve_modes(context.study, context.record("preload", Preload))
    return modes


def march_ringdowns(context: Context) -> RingDowns:
    """March all ring-downs together, from the last finished segment on, and join the segments."""
    fe, study, settings = finite_elements("fe_transients"), context.study, ringdown_settings(context.study)
    preload, modes = context.record("preload", Preload), context.record("modes", Modes)
    segments = march(
        context, fe.Segment, lambda last: fe.march_ringdowns(study, preload, modes, last), settings.duration
    )
    joined = fe.join_ringdowns(segments, study, modes)
    halved = int(joined[0].effort.rejected.sum())
    if halved and settings.error_tolerance is None:
        log.warning("%d time steps did not converge and were halved; a smaller time_step may be faster", halved)
    count = len(settings.training)
    return RingDowns(joined[:count], joined[count:])


def march(
    context: Context, cls: type[Segment], missing: Callable[[Segment | None], Iterator[Segment]], duration: float
) -> tuple[Segment, ...]:
    """Store every segment as soon as it is finished, from the last stored one on, and return all of them.

    Parameters
    ----------
    missing : yields the segments after a given one (None: from the start).
    duration : of the whole march, s.
    """
    settings, segments = ringdown_settings(context.study), context.segments()
    if len(segments):
        log.warning("continued after %d finished segments; wall time and memory are those of the rest", len(segments))
    for segment in missing(segments.last(cls)):
        segments.append(segment)
        done = min(len(segments) * settings.segment_steps * settings.time_step, duration)
        context.report(done / duration, f"{done:.3f} of {duration:.3f} s")
    return segments.load_all(cls)


def ringdown_settings(study: Study) -> RingDownSettings:
    """Return the table [ringdowns]; a study without it raises ``InputError``."""
    if study.ringdowns is None:
        raise InputError("the study has no ring-downs", where="[ringdowns]")
    return study.ringdowns


def finite_elements(module: str) -> ModuleType:
    """Import a door to the finite-element half, which a study from data does without."""
    try:
        return importlib.import_module(f"romgen.{module}")
    except ImportError as error:
        raise InputError(
            "a study with bodies needs the finite-element half", value=str(error), advice="pip install 'romgen[fem]'"
        ) from error


def read_data(context: Context) -> Recorded:
    """Read the files of [data] and share the trajectories out to training and validation."""
    data = context.study.data
    if data is None:
        raise InputError("the study has no data", where="[data]")
    return share_out(data)


def share_out(data: DataSettings) -> Recorded:
    """Read the files of a table [data] and share the trajectories out to training and validation.

    Raises
    ------
    InputError : a file cannot be read, a unit or a trajectory is unknown, or a motion does not come to rest.
    """
    trajectories = read_trajectories(data.files, data.sensors, data.unit)
    groups = (_chosen(trajectories, wanted, data) for wanted in (data.training, data.validation))
    training, validation = (
        tuple(_zeroed(item) for item in group) if data.zero == "rest" else group for group in groups
    )
    return Recorded(training, validation)


def _zeroed(trajectory: Trajectory) -> Trajectory:
    """Return the trajectory counted from where it comes to rest; say how far that is from its recorded zero."""
    rest = rest_position(trajectory)
    offset = offset_percent(trajectory, rest)
    log.info("trajectory '%s' rests %.2g %% of its largest motion off its recorded zero", trajectory.name, offset)
    return counted_from(trajectory, rest)


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
