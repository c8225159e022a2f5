"""What the loads make an interface carry, and what it does carry: the check of a preload."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.contact import ContactState
from fem.interfaces import Pair, Tie
from fem.model import Model


@dataclass(frozen=True)
class InterfaceState:
    """One contact pair at one state.

    ``point`` selects its points among all contact points; pressure, gap (n,) and traction (n, 2) in SI units; status
    (n,) 0 open, 1 stick, 2 slip; slip (n, 2) m, where the springs of stick are anchored; dissipated (n,) work of
    friction per area in J/m^2, nan where it was not kept. ``normal_force`` is the resultant of the pressure, ``force``
    (3,) that of all tractions on the master, ``applied_force`` what the loads send through the pair, nan where supports
    on both sides, springs or a bolt leave that open; ``contact_area`` is the area of the closed points;
    ``paired_share`` is the share of the slave surface that has a partner within the reach at all.
    """

    name: str
    point: IntArray
    pressure: FloatArray
    traction: FloatArray
    gap: FloatArray
    status: IntArray
    slip: FloatArray
    dissipated: FloatArray
    force: FloatArray
    normal_force: float
    applied_force: float
    contact_area: float
    paired_share: float


def interface_states(
    model: Model, u: FloatArray, state: ContactState, case: int = 0, *, dissipated: FloatArray | None = None
) -> tuple[InterfaceState, ...]:
    """The state of every pair at u (n_dof,); ``dissipated`` (n_point,) J/m^2 as the way to it has left it."""
    contact = model.contact
    gap = contact.initial_gap + (contact.operator @ u)[::3]
    traction = state.traction[:, case].reshape(-1, 3)
    work = np.full(contact.n_point, np.nan) if dissipated is None else dissipated
    result = []
    for number, name in enumerate(contact.names):
        point = np.flatnonzero(contact.pair == number)
        pressure, area = -traction[point, 0], contact.area[point]
        status = state.status[point, case]
        result.append(
            InterfaceState(
                name,
                point,
                pressure,
                traction[point, 1:],
                gap[point],
                status,
                state.slip[point, :, case],
                work[point],
                np.einsum("g,gi,gij->j", area, traction[point], contact.frame[point]),
                float(pressure @ area),
                applied_force(model, number),
                float(area[status > 0].sum()),
                float(area.sum() / contact.surface[number, 0]),
            )
        )
    return tuple(result)


def applied_force(model: Model, pair: int) -> float:
    """Resultant in N that the clamping loads press through a pair, along its mean normal; nan where supports share it.

    Without this pair the bodies fall into groups; the group of the slave or of the master that no support holds along
    the normal passes all its load on to the pair.
    """
    normal = _mean_normal(model, pair)
    definition = model.pairs[pair]
    sides = [definition.slave.split(".")[0], definition.master.split(".")[0]]
    for side, other in (sides, sides[::-1]):
        group = _group(model, side, pair)
        if other in group or any(_held(model, body, normal) for body in group):
            continue
        load = sum((_load(model, body) for body in group), np.zeros(3))
        return float(abs(load @ normal))
    return float("nan")


def _mean_normal(model: Model, pair: int) -> FloatArray:
    rows = 3 * np.flatnonzero(model.contact.pair == pair)
    # A rigid translation of the slave moves the gap by the normal: read it from the slave half of the operator.
    name = model.pairs[pair].slave.split(".")[0]
    start, stop = _dofs(model, name)
    columns = np.asarray(model.contact.operator[rows][:, start:stop].sum(axis=0)).reshape(-1, 3)
    normal = columns.sum(axis=0)
    return np.asarray(normal / np.linalg.norm(normal))


def _dofs(model: Model, name: str) -> tuple[int, int]:
    index = [body.name for body in model.bodies].index(name)
    start = 3 * int(model.offsets[index])
    return start, start + 3 * len(model.bodies[index].mesh.points)


def _group(model: Model, body: str, without: int) -> set[str]:
    """Bodies that the ties and the other pairs connect to ``body``."""
    group, grown = {body}, True
    while grown:
        grown = False
        joints: tuple[Pair | Tie, ...] = (*model.pairs, *model.ties)
        for number, pair in enumerate(joints):
            ends = {pair.slave.split(".")[0], pair.master.split(".")[0]}
            if number != without and ends & group and not ends <= group:
                group, grown = group | ends, True
    return group


def _held(model: Model, body: str, normal: FloatArray) -> bool:
    start, stop = _dofs(model, body)
    directions = (~model.free[start:stop].reshape(-1, 3)).any(axis=0)
    sprung = model.springs.operator[:, start:stop].nnz > 0
    return sprung or bool(np.any(np.abs(normal[directions]) > 1e-3))


def _load(model: Model, body: str) -> FloatArray:
    start, stop = _dofs(model, body)
    return np.asarray(model.load[start:stop].reshape(-1, 3).sum(axis=0))
