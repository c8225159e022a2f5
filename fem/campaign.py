"""A campaign of ring-downs: all starts march together on one factor and one pass over the mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fem.arrays import FloatArray, IntArray
from fem.modes import ModalBasis
from fem.motion import MotionState, StepRecord
from fem.preload import Progress, StaticState
from fem.snap_back import hold_modes
from fem.transient import Transient


@dataclass(frozen=True)
class Starts:
    """Where the ring-downs start, at rest.

    Attributes
    ----------
    displacement : (n_dof, n_case) m from the equilibrium.
    slip : (n_point, 2, n_case) m, slip history of the interfaces.
    """

    displacement: FloatArray
    slip: FloatArray


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
    energies : (n_time, 6, n_case) J: kinetic, strain, contact, then friction, damping, external work since t = 0.
    iterations : (n_time, n_case).
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
    iterations: IntArray
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
    return Starts(displacement, np.repeat(equilibrium.contact.slip, len(etas), axis=2))


def snap_back_starts(
    transient: Transient, modes: ModalBasis, etas: Sequence[FloatArray], *, progress: Progress | None = None
) -> Starts:
    """Static states with the wanted modal coordinates, see ``hold_modes``."""
    states = []
    for number, eta in enumerate(etas, 1):
        states.append(hold_modes(transient.model, transient.equilibrium, modes, eta))
        if progress is not None:
            progress(number / len(etas))
    displacement = np.stack([s.u - transient.equilibrium.u for s in states], axis=1)
    return Starts(displacement, np.concatenate([s.contact.slip for s in states], axis=2))


def march_campaign(
    transient: Transient,
    observation: Observation,
    n_step: int,
    segment_steps: int,
    *,
    starts: Starts | None = None,
    restart: MotionState | None = None,
) -> Iterator[CampaignSegment]:
    """Yield the segments that are missing up to step ``n_step``, from ``starts`` or from the state of the last segment.

    Every segment begins with an empty acceleration history, so that a resumed campaign repeats the same numbers bit by
    bit.
    """
    if restart is None:
        if starts is None:
            raise ValueError("a campaign needs starts or a restart state")
        state = transient.start(starts.displacement, np.zeros_like(starts.displacement), starts.slip)
        head = [transient.observe(state)]
    else:
        state, head = restart, []
    while state.step < n_step:
        records = [*head, *transient.march(state, min(segment_steps, n_step - state.step))]
        state, head = records[-1].state, []
        yield _segment(records, transient, observation)


def _segment(records: list[StepRecord], transient: Transient, observation: Observation) -> CampaignSegment:
    rest = transient.equilibrium.u[:, None]
    modes, sensors = observation.modes, observation.sensors
    moved = [r.state.u - rest for r in records]
    kept = [i for i, r in enumerate(records) if r.state.step % observation.stride == 0]
    return CampaignSegment(
        steps=np.array([r.state.step for r in records], dtype=np.int64),
        eta=np.stack([modes.left.T @ q for q in moved]),
        eta_dot=np.stack([modes.left.T @ r.state.v for r in records]),
        eta_ddot=np.stack([modes.shapes.T @ r.net_force for r in records]),
        displacement=np.stack([sensors @ q for q in moved]),
        velocity=np.stack([sensors @ r.state.v for r in records]),
        energies=np.stack([np.concatenate([r.energies, r.state.work]) for r in records]),
        iterations=np.stack([r.iterations for r in records]),
        snapshots=np.array([moved[i] for i in kept], dtype=np.float32).reshape(len(kept), *rest.shape[:1], -1),
        snapshot_steps=np.array([records[i].state.step for i in kept], dtype=np.int64),
        state=records[-1].state,
    )
