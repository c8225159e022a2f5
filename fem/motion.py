"""The state of a transient and what one time step yields."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.contact import ContactState


@dataclass(frozen=True)
class MotionState:
    """All that a restart needs; fields (n_dof, n_case) in SI units, u from the undeformed mesh.

    ``force`` is the internal plus contact force at u, ``viscous`` the damping force of the Green-Lagrange bodies;
    ``inertia_a``, ``damping_a``, ``inertia_v``, ``damping_v`` are M a, C a, M v, C v with C the linear part of the
    damping; ``slip`` (n_point, 2, n_case); ``history`` the last displacements (n_kept, n_dof, n_case), newest first;
    ``work`` (3, n_case) J: friction, damping and external work so far.
    """

    step: int
    u: FloatArray
    v: FloatArray
    a: FloatArray
    force: FloatArray
    viscous: FloatArray
    inertia_a: FloatArray
    damping_a: FloatArray
    inertia_v: FloatArray
    damping_v: FloatArray
    slip: FloatArray
    history: FloatArray
    work: FloatArray


@dataclass(frozen=True)
class StepRecord:
    """What one step yields: the new state, its contact, energies (3, n_case) J and iterations (n_case,).

    ``energies`` are kinetic, strain and contact. ``net_force`` (n_dof, n_case) = p - f - C v at the end of the step:
    the inertia force of the semi-discrete system there (the a of the scheme itself lags by (am - af) h).
    """

    state: MotionState
    contact: ContactState
    energies: FloatArray
    net_force: FloatArray
    iterations: IntArray


@dataclass(frozen=True)
class SolvedStep:
    """Acceleration of a converged step and what belongs to it."""

    a: FloatArray
    force: FloatArray
    viscous: FloatArray
    strain: FloatArray
    contact: ContactState
    iterations: IntArray


def extrapolated(history: FloatArray, shift: FloatArray) -> FloatArray:
    """Next displacement from the parabola through the last ones, newest first; at the start u + h v."""
    if len(history) == 1:
        return np.asarray(history[0] + shift)
    if len(history) == 2:
        return np.asarray(2.0 * history[0] - history[1])
    return np.asarray(3.0 * history[0] - 3.0 * history[1] + history[2])
