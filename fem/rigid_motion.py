"""Rigid motions that neither supports nor interfaces resist: found before a solver meets a singular matrix."""

from __future__ import annotations

import numpy as np

from fem.arrays import BoolArray, FloatArray
from fem.errors import FemInputError
from fem.model import Model

_TOLERANCE = 1e-8
"""Singular value of the restraints, relative to the largest, below which a rigid motion counts as free."""


def rigid_motions(model: Model) -> FloatArray:
    """Three translations and three rotations (about the centre, unit largest displacement) per body, (n_dof, 6 n_body).

    m per m: columns 6 b + (0, 1, 2) translate body b along x, y, z; 6 b + (3, 4, 5) rotate it about x, y, z.
    """
    motions = np.zeros((len(model.points), 3, len(model.bodies), 6))
    for number, (body, offset) in enumerate(zip(model.bodies, model.offsets, strict=True)):
        arm = body.mesh.points - body.mesh.points.mean(axis=0)
        arm = arm / np.linalg.norm(arm, axis=1).max()
        rows = slice(int(offset), int(offset) + len(arm))
        motions[rows, :, number, :3] = np.eye(3)
        motions[rows, :, number, 3:] = np.cross(np.eye(3)[None], arm[:, None, :]).transpose(0, 2, 1)
    return motions.reshape(model.n_dof, -1)


def check_restraint(model: Model) -> None:
    """Raise ``FemInputError`` that names a body which can move freely even with all interfaces closed."""
    share = loose_motion(model, np.ones(model.contact.n_point, dtype=bool))
    if share is None:
        return
    advice = "add a support, a spring, a tie or a contact that holds it"
    raise FemInputError(
        "nothing holds a part of the structure", where=loose_bodies(model, share), value=_words(share), advice=advice
    )


def loose_motion(model: Model, closed: BoolArray, sliding: BoolArray | None = None) -> FloatArray | None:
    """A rigid motion (n_body, 6) that supports, springs, ties and the ``closed`` points (n_point,) let pass, or None.

    Rank of the supported rows and of B R over the rigid motions R; points that have no friction, or are
    ``sliding`` (n_point,), resist along the normal only.
    """
    motions = rigid_motions(model)
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
    return None if size[-1] > _TOLERANCE * size[0] else directions[-1].reshape(-1, 6)


def loose_bodies(model: Model, share: FloatArray) -> str:
    """Names of the bodies that move in a rigid motion (n_body, 6)."""
    part = np.linalg.norm(share, axis=1)
    return ", ".join(body.name for body, size in zip(model.bodies, part, strict=True) if size > 0.1 * part.max())


def _words(share: FloatArray) -> str:
    part = np.linalg.norm(share, axis=1)
    kind, axis = divmod(int(np.abs(share[part.argmax()]).argmax()), 3)
    return f"free to {('translate along', 'rotate about')[kind]} {'xyz'[axis]}"
