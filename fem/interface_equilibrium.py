"""Equilibrium of the contact points that slip or open, found on those points alone within an iteration on the factor.

The factor A of the steps has every closed point stuck. What the tractions of the law add to that, the remainder
phi(v) = tau(v) - D v at the relative displacements v = B u with the sticking stiffness D, acts on few points, and few
points decide how many iterations a step takes. Their own equation needs only the compliance of A between them:

    v = v_k - C (phi(v) - phi_k),   C = (1-af) b h^2 B A^-1 B' w

with v_k at the present iterate and phi_k the remainder that the last correction was made with. Its solution gives the
remainder for the next correction, so that the outer iteration is left with what bodies and other points add. It changes
the way to the solution of a step, not the residual by which that is judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import prange

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.compiled import compiled, inlined, threaded
from fem.contact import Contact, ContactState
from fem.friction import return_map, traction_tangents
from fem.gmres import gmres
from fem.sparse_product import SparseProduct

LARGEST = 1500
"""Points beyond which the dense compliance is no longer small beside the factor."""

UTILISATION = 0.8
"""Share of the friction limit from which on a sticking point is taken for one that will slip."""

GROWTH = 0.1
"""Points join when more than this share of those known slip or open besides."""

GROUP = 10
"""Points whose forces are solved for together: always the same ones, so that a restart finds the same bits."""

NEWTON_STEPS, NEWTON_TOLERANCE = 8, 1e-2


@dataclass(frozen=True)
class LoosePoints:
    """Points whose equilibrium is found apart, and how they move under forces on each other.

    Attributes
    ----------
    index : (n,) numbers among the contact points, in the order in which they joined.
    gap, pull : products with their rows B of the operator, (3 n, n_case) from (n_dof, n_case), and with B'.
    weight : (3 n,) m^2; initial_gap : (n,) m; law : (n, 3) as in ``Contact``; stick : (3 n,) Pa/m, D of the factor.
    compliance : (3 n, 3 n) m/N, (1-af) b h^2 B A^-1 B', symmetric but for rounding.
    """

    index: IntArray
    gap: SparseProduct
    pull: SparseProduct
    weight: FloatArray
    initial_gap: FloatArray
    law: FloatArray
    stick: FloatArray
    compliance: npt.NDArray[np.float32]

    def remainder(self, v: FloatArray, slip: FloatArray) -> FloatArray:
        """phi(v) = tau(v) - D v (3 n, n_case) Pa at v (3 n, n_case) m, slip history (n, 2, n_case) m."""
        out = np.empty_like(v)
        _remainders(self.initial_gap, self.law, self.stick, v, slip, out)
        return out

    def settled(self, v: FloatArray, applied: FloatArray, slip: FloatArray) -> FloatArray:
        """phi (3 n, n_case) Pa at the solution of v_k - C (phi(v) - phi_k) = v; where none is found phi(v_k).

        Newton's method on the points at which phi changes, each step by GMRES.

        Parameters
        ----------
        v : v_k; applied : phi_k, both (3 n, n_case). slip : (n, 2, n_case) m at the beginning of the step.
        """
        out = np.empty_like(v)
        _settle(self.initial_gap, self.law, self.stick, self.weight, self.compliance, v, applied, slip, out)
        return out

    def force(self, traction: FloatArray) -> FloatArray:
        """Nodal forces B' w tau (n_dof, n_case) N of tractions (3 n, n_case) Pa."""
        return self.pull(self.weight[:, None] * traction)


def loose_points(
    contact: Contact,
    closed: BoolArray,
    index: IntArray,
    response: Callable[[FloatArray], FloatArray],
    known: LoosePoints | None = None,
) -> LoosePoints:
    """The points ``index`` (n,) of a contact with their compliance.

    Parameters
    ----------
    closed : (n_point,) points that the factor has stuck.
    response : forces (n_dof, n_column) N -> displacements (n_dof, n_column) m, (1-af) b h^2 A^-1.
    known : the first of these points, by the same factor: nothing is solved for twice.
    """
    rows = (3 * index[:, None] + np.arange(3)).ravel()
    operator = contact.operator[rows].tocsr()
    compliance = np.empty((len(rows), len(rows)), dtype=np.float32)
    start = 0
    if known is not None and np.array_equal(known.index, index[: len(known.index)]):
        start = len(known.compliance)
        compliance[:start, :start] = known.compliance
    for first in range(start, len(rows), 3 * GROUP):
        group = slice(first, first + 3 * GROUP)
        moved = operator[: group.stop] @ response(np.ascontiguousarray(operator[group].T.toarray()))
        compliance[: group.stop, group] = moved
        compliance[group, :first] = moved[:first].T
    stick = contact.law[index][:, [0, 1, 1]] * closed[index, None]
    return LoosePoints(
        index,
        SparseProduct(operator),
        SparseProduct(operator.T.tocsr()),
        np.repeat(contact.area[index], 3),
        contact.initial_gap[index],
        contact.law[index],
        stick.ravel(),
        compliance,
    )


def loosened(index: IntArray, contact: Contact, state: ContactState, closed: BoolArray) -> IntArray:
    """The points ``index`` (n,), behind them more where enough others slip or open in any case of ``state``.

    Those near their friction limit join with them, and the nearest of the rest until a group is full.
    """
    moving = (state.status == 2).any(axis=1) | ((state.status > 0) != closed[:, None]).any(axis=1)
    moving[index] = False
    if np.count_nonzero(moving) <= GROWTH * len(index):
        return index
    normal, first, second = (state.traction[k::3] for k in range(3))
    limit = np.maximum(-contact.law[:, 2:] * normal, np.finfo(float).tiny)
    used = (np.hypot(first, second) / limit).max(axis=1)
    used[moving], used[index] = np.inf, -np.inf
    wanted = -(-np.count_nonzero(used > UTILISATION) // GROUP) * GROUP
    count = min(wanted, LARGEST - len(index), len(used) - len(index))
    return np.concatenate([index, np.argsort(-used, kind="stable")[:count]])


@inlined
def _remainder(
    gap: FloatArray, law: FloatArray, stick: FloatArray, v: FloatArray, slip: FloatArray, g: int, out: FloatArray
) -> None:
    """phi of point g into out (3 n,), for one case."""
    tn, t1, t2, _, _, _ = return_map(
        gap[g] + v[3 * g], v[3 * g + 1], v[3 * g + 2], slip[g, 0], slip[g, 1], law[g, 0], law[g, 1], law[g, 2]
    )
    out[3 * g] = tn - stick[3 * g] * v[3 * g]
    out[3 * g + 1] = t1 - stick[3 * g + 1] * v[3 * g + 1]
    out[3 * g + 2] = t2 - stick[3 * g + 2] * v[3 * g + 2]


@compiled
def _remainders(
    gap: FloatArray, law: FloatArray, stick: FloatArray, v: FloatArray, slip: FloatArray, out: FloatArray
) -> None:
    for c in range(v.shape[1]):
        own_v, own_slip = v[:, c].copy(), slip[:, :, c].copy()
        own = np.empty_like(own_v)
        for g in range(len(gap)):
            _remainder(gap, law, stick, own_v, own_slip, g, own)
        out[:, c] = own


@compiled
def _add_moved(
    compliance: npt.NDArray[np.float32], weight: FloatArray, traction: FloatArray, rows: IntArray, out: FloatArray
) -> None:
    """out += C traction, with traction given at ``rows`` alone; the compliance is symmetric."""
    for k in range(len(rows)):
        force = weight[rows[k]] * traction[k]
        if force != 0.0:
            column = compliance[rows[k]]
            for i in range(len(out)):
                out[i] += column[i] * force


@compiled
def _newton_step(
    tangents: FloatArray,
    stick: FloatArray,
    weight: FloatArray,
    compliance: npt.NDArray[np.float32],
    miss: FloatArray,
) -> FloatArray:
    """The change of v (3 n,) from (I + C D') dv = -miss, D' (n, 3, 3) the tangents of phi.

    The traction y = D' dv has few rows that are not zero: (I + D' C) y = -D' miss on them, then dv = -miss - C y.
    """
    n = len(tangents)
    rows = np.empty(3 * n, dtype=np.int64)
    count = 0
    for g in range(n):
        for i in range(3):
            tangents[g, i, i] -= stick[3 * g + i]
        for i in range(3):
            if tangents[g, i, 0] != 0.0 or tangents[g, i, 1] != 0.0 or tangents[g, i, 2] != 0.0:
                rows[count] = 3 * g + i
                count += 1
    rows = rows[:count].copy()
    matrix, right = np.empty((count, count)), np.empty(count)
    for r in range(count):
        g, i = rows[r] // 3, rows[r] % 3
        d = tangents[g, i]
        right[r] = -(d[0] * miss[3 * g] + d[1] * miss[3 * g + 1] + d[2] * miss[3 * g + 2])
        for s in range(count):
            column = rows[s]
            moved = (
                d[0] * compliance[3 * g, column]
                + d[1] * compliance[3 * g + 1, column]
                + d[2] * compliance[3 * g + 2, column]
            )
            matrix[r, s] = moved * weight[column]
        matrix[r, r] += 1.0
    step = -miss
    moved_by = np.zeros_like(miss)
    _add_moved(compliance, weight, gmres(matrix, right), rows, moved_by)
    return step - moved_by


@threaded
def _settle(
    gap: FloatArray,
    law: FloatArray,
    stick: FloatArray,
    weight: FloatArray,
    compliance: npt.NDArray[np.float32],
    start: FloatArray,
    applied: FloatArray,
    slip: FloatArray,
    out: FloatArray,
) -> None:
    """phi at the solution for every case; phi at the start where Newton does not bring the residual down."""
    n = len(gap)
    every = np.arange(3 * n)
    for c in prange(start.shape[1]):
        begin, own_slip = start[:, c].copy(), slip[:, :, c].copy()
        v, phi, first = begin.copy(), np.empty(3 * n), np.empty(3 * n)
        tangents = np.empty((n, 3, 3))
        size_0 = size = 0.0
        for step in range(NEWTON_STEPS + 1):
            for g in range(n):
                _remainder(gap, law, stick, v, own_slip, g, phi)
            if step == 0:
                first[:] = phi
            miss = v - begin
            _add_moved(compliance, weight, phi - applied[:, c], every, miss)
            size = np.sqrt(np.sum(miss * miss))
            if step == 0:
                size_0 = size
            if step == NEWTON_STEPS or not size > NEWTON_TOLERANCE * size_0:
                break
            traction_tangents(gap, law, v, own_slip, tangents)
            v = v + _newton_step(tangents, stick, weight, compliance, miss)
        good = size < size_0
        for i in range(3 * n):
            out[i, c] = phi[i] if good else first[i]
