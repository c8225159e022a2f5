"""Slave points beyond the reach of a pair: kept aside, and watched for coming through the master surface."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray


class ReachWarning(UserWarning):
    """Surfaces came together where the reach of their pair had left points out."""


class TieWarning(UserWarning):
    """A tie bonds less of its surfaces than they have in common."""


@dataclass(frozen=True)
class LeftOut:
    """Slave points that face the master but lie beyond the reach; they carry nothing.

    Attributes
    ----------
    normal : (n, n_dof) sparse, so that the gap is ``gap`` + normal u; gap, area : (n,) m, m^2.
    points : (n, 3) m; pair : (n,) number of the pair; reach : (n_pair,) m of every pair.
    """

    normal: sp.csr_matrix
    gap: FloatArray
    area: FloatArray
    points: FloatArray
    pair: IntArray
    reach: FloatArray

    def depth(self, u: FloatArray) -> FloatArray:
        """How far the points are behind the master at u (n_dof, n_case) in any case, (n,) m; before it negative."""
        if not len(self.gap):
            return np.empty(0)
        return np.asarray(-(self.gap + (self.normal @ u).min(axis=1)))


def no_depth(left_out: LeftOut) -> FloatArray:
    """Depths (n,) in m from which the largest of a march is gathered: none was behind the master yet."""
    return np.full(len(left_out.gap), -np.inf)


def joined_left_out(parts: tuple[LeftOut, ...], n_dof: int) -> LeftOut:
    """The points of all pairs, numbered by their order."""
    empty = np.empty(0)
    return LeftOut(
        sp.vstack([sp.csr_matrix((0, n_dof)), *(part.normal for part in parts)], format="csr"),
        np.concatenate([empty, *(part.gap for part in parts)]),
        np.concatenate([empty, *(part.area for part in parts)]),
        np.concatenate([np.empty((0, 3)), *(part.points for part in parts)]),
        np.repeat(np.arange(len(parts)), [len(part.gap) for part in parts]),
        np.concatenate([empty, *(part.reach for part in parts)]),
    )


def reach_notes(names: tuple[str, ...], left_out: LeftOut, depth: FloatArray) -> tuple[str, ...]:
    """One line per pair whose left-out points came behind the master by ``depth`` (n,) m: contact is missing there."""
    lines = []
    for number, name in enumerate(names):
        behind = np.flatnonzero((left_out.pair == number) & (depth > 0.0))
        if len(behind):
            worst = behind[np.argmax(depth[behind])]
            at = ", ".join(f"{x:.4g}" for x in left_out.points[worst])
            lines.append(
                f"contact {name}: {left_out.area[behind].sum():.3g} m^2 of the slave farther than the reach of "
                f"{left_out.reach[number]:.3g} m from the master went through it, at ({at}) m by {depth[worst]:.3g} m; "
                f"contact is missing there: give the pair a reach of {1.5 * np.abs(left_out.gap[behind]).max():.2g} m"
            )
    return tuple(lines)


def warn_of_reach(names: tuple[str, ...], left_out: LeftOut, depth: FloatArray) -> None:
    """Issue the notes as ``ReachWarning``."""
    for line in reach_notes(names, left_out, depth):
        warnings.warn(line, ReachWarning, stacklevel=3)
