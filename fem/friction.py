"""Unilateral penalty contact with Coulomb friction by return mapping, point by point.

Normal: tau_n = k_n g for g < 0 (penetration), else 0; pressure p = -tau_n. Tangential: trial k_t (s - s_p); if it
exceeds mu p the slip s_p moves so that abs(tau_t) = mu p. An open point forgets its slip: s_p = s.
Wriggers, Computational Contact Mechanics, 2nd ed., sec. 5.2 and 10.5; paper, eq. (contact law) with penalty in stick.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import compiled, inlined, threaded

OPEN, STICK, SLIP = 0, 1, 2


@inlined
def return_map(
    gap: float, s1: float, s2: float, slip1: float, slip2: float, kn: float, kt: float, mu: float
) -> tuple[float, float, float, float, float, int]:
    """Tractions (tau_n, tau_1, tau_2) in Pa, new slip (s_p1, s_p2) in m and the state of one point."""
    if gap >= 0.0:
        return 0.0, 0.0, 0.0, s1, s2, 0
    tn = kn * gap
    t1, t2 = kt * (s1 - slip1), kt * (s2 - slip2)
    size = np.sqrt(t1 * t1 + t2 * t2)
    limit = -mu * tn
    if size <= limit:
        return tn, t1, t2, slip1, slip2, 1
    t1, t2 = t1 * limit / size, t2 * limit / size
    return tn, t1, t2, s1 - t1 / kt, s2 - t2 / kt, 2


@threaded
def tractions(
    initial_gap: FloatArray,
    law: FloatArray,
    relative: FloatArray,
    slip: FloatArray,
    traction: FloatArray,
    new_slip: FloatArray,
    status: IntArray,
) -> None:
    """The law at all points and cases.

    initial_gap (n_point,) m; law (n_point, 3) k_n, k_t in Pa/m and mu; relative (3 n_point, n_case) normal and two
    tangential relative displacements in m; slip and new_slip (n_point, 2, n_case) m; traction (3 n_point, n_case) Pa
    and status (n_point, n_case) are overwritten.
    """
    for g in prange(len(initial_gap)):
        for c in range(relative.shape[1]):
            tn, t1, t2, p1, p2, state = return_map(
                initial_gap[g] + relative[3 * g, c],
                relative[3 * g + 1, c],
                relative[3 * g + 2, c],
                slip[g, 0, c],
                slip[g, 1, c],
                law[g, 0],
                law[g, 1],
                law[g, 2],
            )
            traction[3 * g, c], traction[3 * g + 1, c], traction[3 * g + 2, c] = tn, t1, t2
            new_slip[g, 0, c], new_slip[g, 1, c] = p1, p2
            status[g, c] = state


@compiled
def traction_tangents(
    initial_gap: FloatArray, law: FloatArray, relative: FloatArray, slip: FloatArray, tangents: FloatArray
) -> None:
    """Consistent tangents d tau / d (g, s_1, s_2), (n_point, 3, 3) Pa/m, unsymmetric in slip.

    In slip tau_t = mu p d with d = trial / abs(trial): d tau_t = -mu k_n d dg + (mu p k_t / abs(trial)) (I - d d') ds.
    """
    for g in range(len(initial_gap)):
        tangents[g] = 0.0
        gap = initial_gap[g] + relative[3 * g]
        if gap >= 0.0:
            continue
        kn, kt, mu = law[g, 0], law[g, 1], law[g, 2]
        t1 = kt * (relative[3 * g + 1] - slip[g, 0])
        t2 = kt * (relative[3 * g + 2] - slip[g, 1])
        size = np.sqrt(t1 * t1 + t2 * t2)
        limit = -mu * kn * gap
        tangents[g, 0, 0] = kn
        if size <= limit:
            tangents[g, 1, 1] = kt
            tangents[g, 2, 2] = kt
            continue
        d1, d2 = t1 / size, t2 / size
        factor = limit * kt / size
        tangents[g, 1, 0], tangents[g, 2, 0] = -mu * kn * d1, -mu * kn * d2
        tangents[g, 1, 1], tangents[g, 1, 2] = factor * (1.0 - d1 * d1), -factor * d1 * d2
        tangents[g, 2, 1], tangents[g, 2, 2] = -factor * d1 * d2, factor * (1.0 - d2 * d2)
