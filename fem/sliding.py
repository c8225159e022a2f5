"""Whether slip stays small enough for gaps and slips that are linear in the displacement."""

from __future__ import annotations

import warnings

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.contact import Contact


class SlidingWarning(UserWarning):
    """Surfaces slid farther than the projection of the undeformed state serves."""


def sliding_motion(contact: Contact, relative: FloatArray, status: IntArray) -> FloatArray:
    """How far closed points moved along the surface in any case, (n_point,) m.

    Relative displacements (3 n_point, n_case) m from the undeformed state and status (n_point, n_case).
    """
    tangential = relative.reshape(contact.n_point, 3, status.shape[1])[:, 1:]
    moved = np.where(status > 0, np.linalg.norm(tangential, axis=1), 0.0).max(axis=1, initial=0.0)
    return np.asarray(moved)


def sliding_notes(contact: Contact, motion: FloatArray) -> tuple[str, ...]:
    """One line per pair whose closed points moved by ``motion`` (n_point,) m, more than their ``slide_limit``.

    The partner of a contact point is found once. A slip s misplaces its force by s on the master and, on a surface of
    radius R, its gap by s^2 / (2 R).
    """
    lines = []
    for number, name in enumerate(contact.names):
        point = np.flatnonzero(contact.pair == number)
        worst = point[np.argmax(motion[point] / contact.slide_limit[point])]
        if motion[worst] > contact.slide_limit[worst]:
            at = ", ".join(f"{x:.4g}" for x in contact.points[worst])
            lines.append(
                f"contact {name}: points slid by {motion[worst]:.3g} m at ({at}) m, more than the "
                f"{contact.slide_limit[worst]:.3g} m (a tenth of a master facet) for which small sliding holds; use "
                "larger facets there or a smaller motion"
            )
    return tuple(lines)


def warn_of_sliding(contact: Contact, motion: FloatArray) -> None:
    """Issue the notes as ``SlidingWarning``."""
    for line in sliding_notes(contact, motion):
        warnings.warn(line, SlidingWarning, stacklevel=3)
