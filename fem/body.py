"""Meshed parts of a structure and the names of what lies on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.material import Material
from fem.mesh import Mesh

KINEMATICS = ("green_lagrange", "linear")


@dataclass(frozen=True)
class Body:
    """A meshed part.

    Attributes
    ----------
    name : no dot in it; "<name>.<surface>" names what lies on the body.
    kinematics : "green_lagrange" keeps all terms; "linear" drops the quadratic strain of this body: its error is of
        the order of its strains and rotations, and it saves the element loop.
    initial_stress : second Piola-Kirchhoff stress in Pa that the undeformed body already carries, S = S_0 + C:E:
        (3, 3) for the whole body or (n_cell, 3, 3); None for none. Only with "green_lagrange".

    Raises
    ------
    FemInputError : unknown kinematics, or an initial stress that is not a symmetric, finite (3, 3) tensor.
    """

    name: str
    mesh: Mesh
    material: Material
    kinematics: str = "green_lagrange"
    initial_stress: FloatArray | None = None

    def __post_init__(self) -> None:
        where = f"body {self.name}"
        if self.kinematics not in KINEMATICS:
            advice = f"choose {' or '.join(KINEMATICS)}"
            raise FemInputError("unknown kinematics", where=where, value=self.kinematics, advice=advice)
        if self.initial_stress is None:
            return
        stress = np.asarray(self.initial_stress)
        if stress.shape not in {(3, 3), (len(self.mesh.cells), 3, 3)} or not np.isfinite(stress).all():
            advice = "give (3, 3) or (n_cell, 3, 3) finite numbers in Pa"
            raise FemInputError("not an initial stress", where=where, value=stress.shape, advice=advice)
        if not np.allclose(stress, np.swapaxes(stress, -1, -2), rtol=1e-12, atol=0.0):
            raise FemInputError("the initial stress is not symmetric", where=where)
        if self.kinematics == "linear":
            advice = 'use kinematics "green_lagrange"'
            raise FemInputError("a linear body takes no initial stress", where=where, advice=advice)

    def cell_stress(self) -> FloatArray:
        """Initial stress of every cell (n_cell, 3, 3) in Pa; (0, 3, 3) where there is none."""
        if self.initial_stress is None:
            return np.empty((0, 3, 3))
        shape = (len(self.mesh.cells), 3, 3)
        return np.ascontiguousarray(np.broadcast_to(np.asarray(self.initial_stress, dtype=float), shape))


def locate(bodies: Sequence[Body], name: str) -> tuple[int, str]:
    """Index of the body and the name on it, from "<body>.<name>"; an unknown body raises ``FemInputError``."""
    body, _, region = name.partition(".")
    names = [b.name for b in bodies]
    if body not in names or not region:
        advice = f"surfaces are <body>.<surface> with the bodies {', '.join(names)}"
        raise FemInputError("unknown surface", where="model", value=name, advice=advice)
    return names.index(body), region
