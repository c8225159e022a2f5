"""What the supports carry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.body import locate
from fem.finite_values import finite_vector
from fem.model import Model
from fem.newton import internal_force
from fem.preload import StaticState


def reaction(model: Model, state: StaticState, region: str, *, load_factor: float = 1.0) -> FloatArray:
    """Resultant (3,) in N of the forces of the supports on the nodes of "<body>.<surface or set>".

    R = sum of f_int + f_contact - lambda p over the held components; free components are in balance and count nothing.
    """
    return np.asarray(_nodal(model, state, region, load_factor)[1].sum(axis=0))


def reaction_moment(
    model: Model, state: StaticState, region: str, about: Sequence[float], *, load_factor: float = 1.0
) -> FloatArray:
    """Moment (3,) in N m of the same forces about a point (m) in space, at the displaced nodes.

    M = sum of (x + u - about) x R.
    """
    nodes, forces = _nodal(model, state, region, load_factor)
    arms = (
        model.points[nodes] + state.u.reshape(-1, 3)[nodes] - finite_vector(about, "the point", where="reaction moment")
    )
    return np.asarray(np.cross(arms, forces).sum(axis=0))


def _nodal(model: Model, state: StaticState, region: str, load_factor: float) -> tuple[IntArray, FloatArray]:
    """Nodes (n,) of a region and the forces (n, 3) in N of the supports on them."""
    where = f"reaction of {region}"
    index, name = locate(model.bodies, region, where=where)
    nodes = model.bodies[index].mesh.nodes(name, where=where) + model.offsets[index]
    force, _ = internal_force(model.following(state.follower), state.u, state.contact.slip)
    carried = np.where(model.free, 0.0, force - load_factor * model.load)
    return nodes, np.asarray(carried.reshape(-1, 3)[nodes])
