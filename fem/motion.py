"""The state of a transient and what one time step yields."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.contact import ContactState


@dataclass(frozen=True)
class Pace:
    """How the march went: what the next step size and the factor depend on, so that a restart chooses the same.

    Attributes
    ----------
    position : time in output intervals, a dyadic fraction inside an interval.
    level : halvings of the output interval that the next step tries first; last_level : those of the last step.
    jerk : (n_dof, n_case) m/s^3, backward difference of the accelerations of the last step.
    peak : (n_case,) largest mass norm of the displacement from the equilibrium so far, m kg^0.5.
    force : (n_case,) N, largest norm of the inertia force so far.
    waited, patience : (n_case,) steps since a case got a factor of its own, and steps to wait for the next one.
    before : (n_case,) iterations of the step for which it got it.
    anchored : (n_anchor,) cases with a factor of their own; anchor_u (n_dof, n_anchor) m and anchor_slip (n_point, 2,
        n_anchor) m: where their tangents were taken.
    loose : (n_loose,) contact points whose equilibrium is found apart, see ``interface_equilibrium``.
    """

    position: float
    level: int
    last_level: int
    jerk: FloatArray
    peak: FloatArray
    force: FloatArray
    waited: IntArray
    patience: IntArray
    before: IntArray
    anchored: IntArray
    anchor_u: FloatArray
    anchor_slip: FloatArray
    loose: IntArray

    @staticmethod
    def beginning(u: FloatArray, slip: FloatArray, peak: FloatArray, force: FloatArray) -> Pace:
        """At t = 0: whole output intervals, the factor of the equilibrium."""
        zero = np.zeros(u.shape[1], dtype=np.int64)
        none = zero[:0]
        still = np.zeros_like(u)
        anchors = none, u[:, :0].copy(), slip[:, :, :0].copy()
        return Pace(0.0, 0, 0, still, peak, force, zero, zero, zero, *anchors, none)


@dataclass(frozen=True)
class MotionState:
    """All that a restart needs; fields (n_dof, n_case) in SI units, u from the undeformed mesh.

    ``step`` is the number of the last output; ``force`` the internal plus contact force at u, ``viscous`` the damping
    force of the Green-Lagrange bodies; ``inertia_a``, ``damping_a``, ``inertia_v``, ``damping_v`` are M a, C a, M v,
    C v with C the linear part of the damping; ``slip`` (n_point, 2, n_case); ``history`` the last displacements
    (n_kept, n_dof, n_case), newest first; ``work`` (3, n_case) J: friction, damping and external work so far.
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
    pace: Pace


@dataclass(frozen=True)
class Effort:
    """What the way to an output took: iterations (n_case,), steps of the scheme, rejected steps, new factors."""

    iterations: IntArray
    substeps: int = 0
    rejected: int = 0
    factors: int = 0

    @staticmethod
    def none(n_case: int) -> Effort:
        """Nothing done yet."""
        return Effort(np.zeros(n_case, dtype=np.int64))

    def __add__(self, other: Effort) -> Effort:
        return Effort(
            self.iterations + other.iterations,
            self.substeps + other.substeps,
            self.rejected + other.rejected,
            self.factors + other.factors,
        )


@dataclass(frozen=True)
class StepRecord:
    """What is known at one output: the state, its contact, energies (3, n_case) J and the effort since the last one.

    ``energies`` are kinetic, strain and contact. ``net_force`` (n_dof, n_case) = p - f - C v at this time: the inertia
    force of the semi-discrete system there (the a of the scheme itself lags by (am - af) h). ``support_force`` (n_held,
    n_case) N acts on the held degrees of freedom, see ``SupportForces``. ``resume`` is where to march on: ``state``
    itself, or the beginning of the step inside which this output lies.
    """

    state: MotionState
    contact: ContactState
    energies: FloatArray
    net_force: FloatArray
    support_force: FloatArray
    effort: Effort
    resume: MotionState

    @property
    def iterations(self) -> IntArray:
        """Iterations since the last output, (n_case,)."""
        return self.effort.iterations


@dataclass(frozen=True)
class SolvedStep:
    """Acceleration of a converged step and what belongs to it, see ``step_equation.Trial``."""

    a: FloatArray
    inertia_a: FloatArray
    damping_a: FloatArray
    force: FloatArray
    viscous: FloatArray
    strain: FloatArray
    contact: ContactState
    iterations: IntArray


def extrapolated(history: FloatArray, shift: FloatArray) -> FloatArray:
    """Next displacement from the polynomial through the last ones, newest first; at the start u + h v.

    u_(n+1) = sum_k (-1)^k C(m, k+1) u_(n-k) through m states misses h^m u^(m).
    """
    kept = len(history)
    if kept == 1:
        return np.asarray(history[0] + shift)
    weights = np.array([(-1.0) ** k * comb(kept, k + 1) for k in range(kept)])
    return np.asarray(np.tensordot(weights, history, axes=1))
