"""What the supports carry."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.body import locate
from fem.model import Model
from fem.newton import internal_force
from fem.preload import StaticState


def reaction(model: Model, state: StaticState, region: str, *, load_factor: float = 1.0) -> FloatArray:
    """Resultant (3,) in N of the forces of the supports on the nodes of "<body>.<surface or set>".

    R = sum of f_int + f_contact - lambda p over the held components; free components are in balance and count nothing.
    """
    index, name = locate(model.bodies, region)
    nodes = model.bodies[index].mesh.nodes(name) + model.offsets[index]
    force, _ = internal_force(model, state.u, state.contact.slip)
    carried = np.where(model.free, 0.0, force - load_factor * model.load)
    return np.asarray(carried.reshape(-1, 3)[nodes].sum(axis=0))
