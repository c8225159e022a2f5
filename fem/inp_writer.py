"""A model as Abaqus and CalculiX input: nodes, cells, sets, surfaces, materials, supports, ties, contact; no steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.errors import FemInputError
from fem.inp_file import HEX_FACES, TET_FACES
from fem.interfaces import Pair, Tie
from fem.mesh import Mesh
from fem.model import Model

_ELEMENTS = {"hex20": "C3D20", "tet10": "C3D10"}
_PER_LINE = 10
_TIED = 1e-3
"""Slave nodes are tied up to this share of the mean facet size away from the master: surfaces that touch."""


def write_inp(path: Path | str, model: Model) -> None:
    """Write everything of a model but its loads and steps: append those, with ``nodal_loads``.

    Bodies become element sets of their names and sections; a surface or node set b of body a becomes a_b. Supports
    become *BOUNDARY, ties *TIE, frictional pairs *CONTACT PAIR (surface to surface) with the penalties of the model.
    Node n of the model is node n + 1 of the file; lengths in m, stress in Pa, mass in kg.

    Raises
    ------
    FemInputError : HEX27 cells, which CalculiX does not have, an initial stress, bolts, springs, point masses,
        supports that move, follower pressures.
    """
    path = Path(path)
    _check(path, model)
    path.write_text("\n".join([*_mesh(model), *_materials(model), *_supports(model), *_joints(model), ""]))


def nodal_loads(load: FloatArray) -> str:
    """The *CLOAD block of nodal forces (n_dof,) in N, which replaces what the step before applied."""
    forces = np.asarray(load).reshape(-1, 3)
    lines = [f"{node + 1},{axis + 1},{forces[node, axis]:.13e}" for node, axis in np.argwhere(forces)]
    return "\n".join(["*CLOAD,OP=NEW", *lines])


def _check(path: Path, model: Model) -> None:
    for body in model.bodies:
        where = f"{path.name}, body {body.name}"
        if body.mesh.element not in _ELEMENTS:
            advice = f"mesh it with one of {', '.join(_ELEMENTS)}"
            raise FemInputError("this element is not written", where=where, value=body.mesh.element, advice=advice)
        if body.initial_stress is not None:
            raise FemInputError("an initial stress is not written", where=where)
    if model.bolts.bolts:
        raise FemInputError("bolts are not written", where=path.name, value=len(model.bolts.bolts))
    if model.springs.names or model.point_masses:
        names = (*model.springs.names, *(mass.name for mass in model.point_masses))
        raise FemInputError("springs and point masses are not written", where=path.name, value=", ".join(names))
    if model.followers.patches:
        raise FemInputError("follower pressures are not written", where=path.name, value=len(model.followers.patches))
    if np.any(model.prescribed):
        raise FemInputError("only supports at rest are written", where=path.name)


def _mesh(model: Model) -> Iterator[str]:
    yield "*NODE,NSET=all_nodes"
    yield from (f"{n},{x:.13e},{y:.13e},{z:.13e}" for n, (x, y, z) in enumerate(model.points, 1))
    first = 1
    for body, offset in zip(model.bodies, model.offsets, strict=True):
        mesh = body.mesh
        yield f"*ELEMENT,TYPE={_ELEMENTS[mesh.element]},ELSET={body.name}"
        for label, cell in enumerate(mesh.cells + offset + 1, first):
            yield from _lines([label, *cell], ending=",")
        for name, nodes in mesh.node_sets.items():
            yield f"*NSET,NSET={body.name}_{name}"
            yield from _lines(nodes + offset + 1)
        for name, facets in mesh.surfaces.items():
            yield f"*SURFACE,NAME={body.name}_{name},TYPE=ELEMENT"
            yield from (f"{first + cell},S{face + 1}" for cell, face in _cell_faces(mesh, facets))
        first += len(mesh.cells)


def _lines(labels: Iterable[int], ending: str = "") -> Iterator[str]:
    """Ten labels per line; ``ending`` goes behind all lines but the last, as the lines of one element need it."""
    text = [str(label) for label in labels]
    starts = range(0, len(text), _PER_LINE)
    for start in starts:
        yield ",".join(text[start : start + _PER_LINE]) + (ending if start != starts[-1] else "")


def _cell_faces(mesh: Mesh, facets: IntArray) -> IntArray:
    """Cell and face, counted from 0 in the order of the file, of every facet, (n_facet, 2)."""
    table = np.array(TET_FACES if mesh.element == "tet10" else HEX_FACES)
    n_corner = table.shape[1]
    faces = np.sort(mesh.cells[:, table].reshape(-1, n_corner), axis=1)
    wanted = np.sort(facets[:, :n_corner], axis=1)
    _, number = np.unique(np.vstack([faces, wanted]), axis=0, return_inverse=True)
    number = number.ravel()
    place = np.empty(number.max() + 1, dtype=np.int64)
    place[number[: len(faces)]] = np.arange(len(faces))
    return np.column_stack(np.divmod(place[number[len(faces) :]], len(table)))


def _materials(model: Model) -> Iterator[str]:
    for body in model.bodies:
        material = body.material
        yield f"*MATERIAL,NAME={body.name}"
        yield f"*ELASTIC\n{material.young_modulus:.13e},{material.poisson_ratio:.13e}"
        yield f"*DENSITY\n{material.density:.13e}"
        yield f"*SOLID SECTION,ELSET={body.name},MATERIAL={body.name}"


def _supports(model: Model) -> Iterator[str]:
    yield "*BOUNDARY"
    yield from (f"{node + 1},{axis + 1}" for node, axis in np.argwhere(~model.free.reshape(-1, 3)))


def _joints(model: Model) -> Iterator[str]:
    for number, tie in enumerate(model.ties):
        size = float(model.bonds.facet_size[model.bonds.pair == number].mean())
        yield f"*TIE,NAME={tie.name},ADJUST=NO,POSITION TOLERANCE={_TIED * size:.6e}"
        yield _surfaces(tie)
    for number, pair in enumerate(model.pairs):
        normal, tangential, friction = model.contact.law[model.contact.pair == number][0]
        yield f"*SURFACE INTERACTION,NAME={pair.name}"
        yield f"*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n{normal:.13e}"
        if friction > 0.0:
            yield f"*FRICTION\n{friction:.13e},{tangential:.13e}"
        yield f"*CONTACT PAIR,INTERACTION={pair.name},TYPE=SURFACE TO SURFACE"
        yield _surfaces(pair)


def _surfaces(joint: Tie | Pair) -> str:
    return ",".join(name.replace(".", "_") for name in (joint.slave, joint.master))
