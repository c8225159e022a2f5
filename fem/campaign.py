"""A campaign of ring-downs: all starts march together on one factor and one pass over the mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fem.arrays import FloatArray, IntArray
from fem.bounds import require_count
from fem.central_difference import ExplicitTransient
from fem.dynamics import Dynamics
from fem.errors import FemError, FemInputError
from fem.modes import ModalBasis
from fem.motion import MotionState, StepRecord
from fem.preload import Progress, StaticState
from fem.snap_back import hold_modes
from fem.transient import Transient


class Marching(Protocol):
    """What a campaign needs of a time scheme: ``Transient`` or ``ExplicitTransient``."""

    equilibrium: StaticState
    rest_energies: FloatArray
    dynamics: Dynamics

    def start(
        self, displacement: FloatArray, velocity: FloatArray, slip: FloatArray | None = None, *, settled: bool = False
    ) -> MotionState:
        """State at t = 0."""

    def observe(self, state: MotionState) -> StepRecord:
        """Record of a state that no step led to."""

    def march(self, state: MotionState, n_step: int) -> Iterator[StepRecord]:
        """Records of the next outputs."""


@dataclass(frozen=True)
class Starts:
    """Where the motions start.

    Attributes
    ----------
    displacement : (n_dof, n_case) m from the equilibrium.
    slip : (n_point, 2, n_case) m, slip history of the interfaces.
    velocity : (n_dof, n_case) m/s, None at rest.
    settled : only slow modes are out of balance, see ``Transient.start``.
    """

    displacement: FloatArray
    slip: FloatArray
    velocity: FloatArray | None = None
    settled: bool = False


@dataclass(frozen=True)
class Observation:
    """What is kept of every step.

    Attributes
    ----------
    modes : coordinates eta = Phi' M u of all of them.
    sensors : (n_sensor, n_dof) rows, x = S u.
    stride : a full field is kept every so many steps.
    """

    modes: ModalBasis
    sensors: FloatArray
    stride: int


@dataclass(frozen=True)
class CampaignSegment:
    """A stretch of the campaign; the first one begins with t = 0.

    Attributes
    ----------
    steps : (n_time,) step numbers.
    eta, eta_dot, eta_ddot : (n_time, n_mode, n_case) m kg^0.5 and per s, s^2; eta_ddot = Phi' (p - f - C v).
    displacement, velocity : (n_time, n_sensor, n_case) m, m/s.
    energies : (n_time, 6, n_case) J: kinetic, strain, contact, relative to the equilibrium, then friction, damping,
        external work since t = 0.
    reaction : (n_time, n_support, 3, n_case) N; spring : (n_time, n_spring, 3, n_case) N, see ``History``.
    iterations : (n_time, n_case), those of rejected steps included.
    effort : (n_time, 3) steps of the scheme, rejected steps and refreshed factors since the output before.
    snapshots : (n_snapshot, n_dof, n_case) m from the equilibrium; snapshot_steps : (n_snapshot,).
    state : where the next segment starts.
    """

    steps: IntArray
    eta: FloatArray
    eta_dot: FloatArray
    eta_ddot: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    energies: FloatArray
    reaction: FloatArray
    spring: FloatArray
    iterations: IntArray
    effort: IntArray
    snapshots: npt.NDArray[np.float32]
    snapshot_steps: IntArray
    state: MotionState


def modal_coordinates(modes: ModalBasis, peaks: Sequence[float]) -> FloatArray:
    """eta_j at which mode j alone peaks at ``peaks[j]`` m somewhere on the structure, (n_peak,)."""
    shapes = modes.shapes[:, : len(peaks)].reshape(-1, 3, len(peaks))
    return np.asarray(np.asarray(peaks, dtype=float) / np.linalg.norm(shapes, axis=1).max(axis=0))


def modal_starts(modes: ModalBasis, equilibrium: StaticState, etas: Sequence[FloatArray]) -> Starts:
    """Displacements along the mode shapes, u = Phi eta: everything else has to settle after the release."""
    displacement = np.stack([modes.shapes[:, : len(eta)] @ eta for eta in etas], axis=1)
    return replace(moving_starts(equilibrium, displacement, None), settled=False)


def moving_starts(equilibrium: StaticState, displacement: FloatArray, velocity: FloatArray | None) -> Starts:
    """A displacement and velocity (n_dof, n_case) of a slow motion, with the slip history of the equilibrium."""
    slip = np.repeat(equilibrium.contact.slip, displacement.shape[1], axis=2)
    return Starts(displacement, slip, velocity, settled=True)


def snap_back_starts(
    transient: Transient | ExplicitTransient,
    modes: ModalBasis,
    etas: Sequence[FloatArray],
    *,
    progress: Progress | None = None,
) -> Starts:
    """Static states with the wanted modal coordinates, see ``hold_modes``."""
    states = []
    for number, eta in enumerate(etas, 1):
        solver = transient.settings.solver
        states.append(hold_modes(transient.model, transient.equilibrium, modes, eta, solver=solver))
        if progress is not None:
            progress(number / len(etas))
    displacement = np.stack([s.u - transient.equilibrium.u for s in states], axis=1)
    slip = np.concatenate([s.contact.slip for s in states], axis=2)
    return Starts(displacement, slip, settled=True)


def march_campaign(
    transient: Marching,
    observation: Observation,
    n_step: int,
    segment_steps: int,
    *,
    starts: Starts | None = None,
    restart: MotionState | None = None,
) -> Iterator[CampaignSegment]:
    """Yield the segments that are missing up to step ``n_step``, from ``starts`` or from the state of the last segment.

    Nothing but the state passes from one segment to the next, so that a resumed campaign repeats the same numbers bit
    by bit.
    """
    require_count("campaign", "n_step", n_step, 0)
    require_count("campaign", "segment_steps", segment_steps, 1)
    require_count("observation", "stride", observation.stride, 1)
    rows: list[_Row] = []
    if restart is not None:
        state = restart
    else:
        if starts is None:
            raise FemInputError("a campaign needs starts or a restart state", where="campaign")
        velocity = np.zeros_like(starts.displacement) if starts.velocity is None else starts.velocity
        state = transient.start(starts.displacement, velocity, starts.slip, settled=starts.settled)
        rows.append(_observe(transient.observe(state), transient, observation))
    while state.step < n_step:
        failure = None
        try:
            for record in transient.march(state, min(segment_steps, n_step - state.step)):
                rows.append(_observe(record, transient, observation))
                state = record.resume
        except FemError as error:
            failure = error
        # What a failed step leaves behind is handed on first: nothing computed is lost.
        if rows:
            yield _segment(rows, state)
        if failure is not None:
            raise failure
        rows = []


@dataclass(frozen=True)
class _Row:
    """One step of a segment; the large state of the step is not kept."""

    step: int
    fields: tuple[npt.NDArray[Any], ...]
    snapshot: npt.NDArray[np.float32] | None


def _observe(record: StepRecord, transient: Marching, observation: Observation) -> _Row:
    modes, sensors, state = observation.modes, observation.sensors, record.state
    moved = state.u - transient.equilibrium.u[:, None]
    fields = (
        modes.left.T @ moved,
        modes.left.T @ state.v,
        modes.shapes.T @ record.net_force,
        sensors @ moved,
        sensors @ state.v,
        np.concatenate([record.energies - transient.rest_energies, state.work]),
        transient.dynamics.support_force.resultants(record),
        transient.dynamics.spring_force.resultants(record),
        record.iterations,
        np.array([record.effort.substeps, record.effort.rejected, record.effort.factors]),
    )
    kept = state.step % observation.stride == 0
    return _Row(state.step, fields, moved.astype(np.float32) if kept else None)


def _segment(rows: list[_Row], state: MotionState) -> CampaignSegment:
    columns = [np.stack(column) for column in zip(*(row.fields for row in rows), strict=True)]
    eta, eta_dot, eta_ddot, displacement, velocity, energies, reaction, spring, iterations, effort = columns
    snapshots = [row.snapshot for row in rows if row.snapshot is not None]
    return CampaignSegment(
        steps=np.array([row.step for row in rows], dtype=np.int64),
        eta=eta,
        eta_dot=eta_dot,
        eta_ddot=eta_ddot,
        displacement=displacement,
        velocity=velocity,
        energies=energies,
        reaction=reaction,
        spring=spring,
        iterations=iterations.astype(np.int64),
        effort=effort.astype(np.int64),
        snapshots=np.array(snapshots, dtype=np.float32).reshape(len(snapshots), *state.u.shape),
        snapshot_steps=np.array([row.step for row in rows if row.snapshot is not None], dtype=np.int64),
        state=state,
    )
