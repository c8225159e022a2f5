"""Rigid motions that neither supports nor interfaces resist: found before a solver meets a singular matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.errors import FemInputError
from fem.model import Model

_TOLERANCE = 1e-8
"""Singular value of the restraints, relative to the largest, below which a rigid motion counts as free."""


@dataclass(frozen=True)
class Part:
    """Cells of a body that hang together: nearly always all of them. ``nodes`` (n,) are numbers in the model."""

    name: str
    nodes: IntArray


def parts(model: Model) -> tuple[Part, ...]:
    """All parts of all bodies; where a body falls into several they are named by their number and place."""
    found = []
    for body, offset in zip(model.bodies, model.offsets, strict=True):
        mesh, n = body.mesh, len(body.mesh.points)
        others = mesh.cells[:, 1:]
        ends = np.repeat(mesh.cells[:, 0], others.shape[1]), others.ravel()
        graph = sp.csr_matrix((np.ones(len(ends[0]), dtype=bool), ends), shape=(n, n))
        count, label = sp.csgraph.connected_components(graph, directed=False)
        for number in range(count):
            nodes = np.flatnonzero(label == number)
            x, y, z = mesh.points[nodes].mean(axis=0)
            place = f", part {number + 1} of {count} around ({x:.4g}, {y:.4g}, {z:.4g}) m"
            found.append(Part(body.name + (place if count > 1 else ""), nodes + int(offset)))
    return tuple(found)


def rigid_motions(model: Model) -> FloatArray:
    """Three translations and three rotations (about the centre, unit largest displacement) per part, (n_dof, 6 n_part).

    m per m: columns 6 b + (0, 1, 2) translate part b along x, y, z; 6 b + (3, 4, 5) rotate it about x, y, z. A body is
    one part unless its cells do not hang together.
    """
    pieces = parts(model)
    motions = np.zeros((len(model.points), 3, len(pieces), 6))
    for number, part in enumerate(pieces):
        arm = model.points[part.nodes] - model.points[part.nodes].mean(axis=0)
        arm = arm / np.linalg.norm(arm, axis=1).max()
        motions[part.nodes, :, number, :3] = np.eye(3)
        motions[part.nodes, :, number, 3:] = np.cross(np.eye(3)[None], arm[:, None, :]).transpose(0, 2, 1)
    return motions.reshape(model.n_dof, -1)


def check_restraint(model: Model) -> None:
    """Raise ``FemInputError`` that names a part which can move freely even with all interfaces closed."""
    share = loose_motion(model, np.ones(model.contact.n_point, dtype=bool))
    if share is None:
        return
    where = loose_bodies(model, share)
    advice = "add a support, a spring, a tie or a contact that holds it"
    if ", part " in where:
        advice += "; parts of one body share no node: join coincident ones with merged"
    raise FemInputError("nothing holds a part of the structure", where=where, value=_words(share), advice=advice)


def check_closed(model: Model, status: IntArray, who: str) -> None:
    """Raise ``FemInputError`` where contact that is open, by ``status`` (n_point,), leaves a part loose.

    ``who`` linearises there: a Newton step from such a state has a singular matrix.
    """
    share = loose_motion(model, status > 0)
    if share is None:
        return
    contact = model.contact
    names = [name for n, name in enumerate(contact.names) if not (status[contact.pair == n] > 0).any()]
    value = f"{loose_bodies(model, share)} {_words(share)}, contact {', '.join(names) or 'in part'} open"
    advice = "give a state with this contact closed, as solve_static finds; at rest, surfaces that just touch are open"
    raise FemInputError("open contact leaves a part loose in the given state", where=who, value=value, advice=advice)


def loose_motion(model: Model, closed: BoolArray, sliding: BoolArray | None = None) -> FloatArray | None:
    """A rigid motion (n_part, 6) that supports, springs, ties and the ``closed`` points (n_point,) let pass, or None.

    Points that have no friction, or are ``sliding`` (n_point,), resist along the normal only.
    """
    loose = _loose_space(model, rigid_motions(model), closed, sliding)
    return loose[-1].reshape(-1, 6) if len(loose) else None


def loose_drift(model: Model, closed: BoolArray, force: FloatArray) -> FloatArray:
    """Rigid displacement (n_dof,) along which ``force`` (n_dof,) N drives loose parts, largest component 1; or 0."""
    motions = rigid_motions(model)
    loose = _loose_space(model, motions, closed, None)
    work = motions.T @ force
    # What is driven by rounding alone, such as a spin about an axis of symmetry, stays where it is.
    drive = loose.T @ (loose @ work)
    if np.linalg.norm(drive) <= _TOLERANCE * np.abs(force).sum():
        return np.zeros(model.n_dof)
    drift = motions @ drive
    return np.asarray(drift / np.abs(drift).max())


def _loose_space(model: Model, motions: FloatArray, closed: BoolArray, sliding: BoolArray | None) -> FloatArray:
    """Null space (n_loose, 6 n_part) of the supported rows and of B R over the rigid motions R, least resisted last."""
    contact, bonds = model.contact, model.bonds
    rough = closed & (contact.law[:, 2] > 0.0)
    if sliding is not None:
        rough &= ~sliding
    resists = np.column_stack([closed, rough, rough]).ravel()
    parts = [motions[~model.free], (contact.operator @ motions)[resists], bonds.operator @ motions]
    parts.append(model.springs.operator @ motions)
    # At least as many rows as columns, so that every direction of the null space has its singular value.
    restraint = np.vstack([*parts, np.zeros((motions.shape[1], motions.shape[1]))])
    _, size, directions = np.linalg.svd(restraint, full_matrices=False)
    return np.asarray(directions[size <= _TOLERANCE * size[0]])


def loose_bodies(model: Model, share: FloatArray) -> str:
    """Names of the parts that move in a rigid motion (n_part, 6)."""
    size = np.linalg.norm(share, axis=1)
    return ", ".join(part.name for part, own in zip(parts(model), size, strict=True) if own > 0.1 * size.max())


def _words(share: FloatArray) -> str:
    size = np.linalg.norm(share, axis=1)
    kind, axis = divmod(int(np.abs(share[size.argmax()]).argmax()), 3)
    return f"free to {('translate along', 'rotate about')[kind]} {'xyz'[axis]}"
