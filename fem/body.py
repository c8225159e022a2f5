"""Meshed parts of a structure and the names of what lies on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.material import Material
from fem.mesh import SKIN, Mesh
from fem.names import nearest

KINEMATICS = ("green_lagrange", "linear")


@dataclass(frozen=True)
class Body:
    """A meshed part.

    Attributes
    ----------
    name : without a dot, since "<name>.<surface>" names what lies on the body.
    kinematics : "green_lagrange" keeps all terms; "linear" drops the quadratic strain of this body: its error is of
        the order of its strains and rotations, and it saves the element loop.
    initial_stress : second Piola-Kirchhoff stress in Pa that the undeformed body already carries, S = S_0 + C:E:
        (3, 3) for the whole body or (n_cell, 3, 3); None for none. Only with "green_lagrange".

    Raises
    ------
    FemInputError : a name that is empty or has a dot, unknown kinematics, a mesh with nodes in no cell, or an initial
        stress that is not a symmetric, finite (3, 3) tensor.
    """

    name: str
    mesh: Mesh
    material: Material
    kinematics: str = "green_lagrange"
    initial_stress: FloatArray | None = None

    def __post_init__(self) -> None:
        where = f"body {self.name}"
        if not isinstance(self.name, str) or not self.name or "." in self.name:
            advice = 'give a name without a dot: "<body>.<surface>" names what lies on it'
            raise FemInputError("not a name for a body", where="body", value=repr(self.name), advice=advice)
        lonely = np.setdiff1d(np.arange(len(self.mesh.points)), self.mesh.cells)
        if len(lonely):
            value = f"node {lonely[0]} at {self.mesh.points[lonely[0]]} and {len(lonely) - 1} others"
            raise FemInputError("nodes belong to no cell", where=where, value=value, advice="drop them from the mesh")
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


def locate(bodies: Sequence[Body], name: str, *, where: str = "model", surface: bool = False) -> tuple[int, str]:
    """Index of the body and the name on it, from "<body>.<name>".

    Parameters
    ----------
    where : who asks, for the errors.
    surface : only surfaces will do; otherwise node sets, and "a&b" for the nodes that both have, too.

    Raises
    ------
    FemInputError : an unknown name, with those nearest to it.
    """
    body, _, region = str(name).partition(".")
    names = [b.name for b in bodies]
    what = "unknown surface" if surface else "unknown surface or node set"
    if body not in names or not region:
        known = [f"{b.name}.{r}" for b in bodies for r in _regions(b.mesh, surface=surface)]
        advice = (
            f"names are <body>.<surface> with the bodies {', '.join(names)}; {nearest(str(name), known, 'known are')}"
        )
        raise FemInputError(what, where=where, value=name, advice=advice)
    mesh = bodies[names.index(body)].mesh
    known = _regions(mesh, surface=surface)
    for part in [region] if surface or region in known else region.split("&"):
        if part in known or part == SKIN:
            continue
        if surface and part in mesh.node_sets:
            what = "a set of nodes is no surface"
        advice = f"{nearest(part, known, 'known surfaces:')} on body {body}"
        raise FemInputError(what, where=where, value=part, advice=advice)
    return names.index(body), region


def _regions(mesh: Mesh, *, surface: bool) -> list[str]:
    return [*mesh.surfaces] if surface else [*mesh.surfaces, *mesh.node_sets]
