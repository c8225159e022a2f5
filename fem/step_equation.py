"""The equation of one generalised-alpha step of a given size, and the motion that its solution gives.

Chung & Hulbert, J. Appl. Mech. 60 (1993) 371-375:

    M a_(n+1-am) + C v_(n+1-af) + (1-af) f_(n+1) + af f_n = (1-af) p_(n+1) + af p_n
    u_(n+1) = u_n + h v_n + h^2 ((1/2-b) a_n + b a_(n+1)),   v_(n+1) = v_n + h ((1-g) a_n + g a_(n+1))
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.contact import ContactState
from fem.dynamics import Dynamics
from fem.generalized_alpha import Scheme
from fem.motion import Effort, MotionState, SolvedStep, StepRecord
from fem.step_sums import balanced, displaced

_ROUNDOFF = 1e-10
"""Share of the momentum that the residual of a step may not resolve: a body in free flight has no other force."""

KEPT = 4
"""Displacements that the next one is extrapolated from; with more, the noise of the tolerance outweighs the gain."""


@dataclass(frozen=True)
class StepProblem:
    """r(a) = L a + (1-af) f(u0 + b h^2 a, v0 + g h a) + constant = 0 for the a at the end of the step.

    Fields (n_dof, n_case); ``linear`` the force K u0 of the linear bodies; ``slip`` (n_point, 2, n_case) at the
    beginning; ``guess`` the a to start from; ``number`` of the output that the step leads to; ``force`` (n_case,) N,
    the largest of the inertia forces so far, the loads of this step, and what roundoff leaves of M v / h.
    """

    u0: FloatArray
    v0: FloatArray
    constant: FloatArray
    linear: FloatArray
    slip: FloatArray
    guess: FloatArray
    number: int
    force: FloatArray

    def cases(self, chosen: IntArray) -> StepProblem:
        """The problem of some cases alone."""
        fields = (self.u0, self.v0, self.constant, self.linear, self.slip, self.guess)
        u0, v0, constant, linear, slip, guess = (np.ascontiguousarray(x[..., chosen]) for x in fields)
        return StepProblem(u0, v0, constant, linear, slip, guess, self.number, self.force[chosen])


@dataclass(frozen=True)
class Trial:
    """Forces, M a, C a, contact and residual, all (n_dof, n_case) N, and strain energy (n_case,) J at one a."""

    force: FloatArray
    viscous: FloatArray
    inertia_a: FloatArray
    damping_a: FloatArray
    strain: FloatArray
    contact: ContactState
    residual: FloatArray


class StepEquation:
    """The discrete equation for steps of ``step`` s.

    Parameters
    ----------
    correction : left vectors M phi_j (n_dof, k) of the corrected modes and their relative extra inertia r_j (k,).
    """

    def __init__(
        self, dynamics: Dynamics, scheme: Scheme, step: float, correction: tuple[FloatArray, FloatArray]
    ) -> None:
        self.dynamics, self.scheme, self.step, self.correction = dynamics, scheme, step, correction
        # What is linear in a_(n+1) acts through one matrix: mass, its damping, and the damping of the linear bodies.
        self._linear = (1.0 - scheme.alpha_m) * dynamics.model.mass + (
            1.0 - scheme.alpha_f
        ) * step * scheme.gamma * dynamics.damping_matrix
        of_acceleration = (step**2 * scheme.beta, dynamics.alpha, dynamics.beta)
        self._weights = (*of_acceleration, 1.0 - scheme.alpha_m, 1.0 - scheme.alpha_f, step * scheme.gamma)

    def matrix(self, stiffness: sp.csr_matrix, viscous: sp.csr_matrix) -> sp.csr_matrix:
        """d r / d a without the low-rank inertia, from d f / d u and d f / d v in N/m and N s/m, constrained."""
        h, s = self.step, self.scheme
        return self.dynamics.model.constrain(
            self._linear + (1.0 - s.alpha_f) * h * (s.gamma * viscous + h * s.beta * stiffness)
        )

    def correct_inertia(self, a: FloatArray) -> FloatArray:
        """The low-rank inertia of the dispersion correction, sum_j M phi_j r_j phi_j' M a."""
        left, ratio = self.correction
        return np.asarray(left @ (ratio[:, None] * (left.T @ a)))

    def problem(self, old: MotionState, guess: FloatArray, loads: tuple[FloatArray, FloatArray]) -> StepProblem:
        """What is known at the beginning; ``guess`` a displacement, ``loads`` p at both ends (n_dof, n_case) N."""
        h, s, (p_old, p_new) = self.step, self.scheme, loads
        u0 = old.u + h * old.v + h * h * (0.5 - s.beta) * old.a
        damping_v0 = old.damping_v + h * (1.0 - s.gamma) * old.damping_a
        constant = (
            s.alpha_m * (old.inertia_a + self.correct_inertia(old.a))
            + (1.0 - s.alpha_f) * damping_v0
            + s.alpha_f * (old.damping_v + old.force + old.viscous - p_old)
            - (1.0 - s.alpha_f) * p_new
        )
        v0 = old.v + h * (1.0 - s.gamma) * old.a
        linear = self.dynamics.linear.stiffness(u0)
        first = (guess - u0) / (h * h * s.beta)
        return StepProblem(u0, v0, constant, linear, old.slip, first, old.step + 1, self._force(old, p_new))

    def _force(self, old: MotionState, load: FloatArray) -> FloatArray:
        dynamics = self.dynamics
        given = dynamics.norm(load - dynamics.model.load[:, None])
        roundoff = _ROUNDOFF / self.step * dynamics.norm(old.inertia_v)
        return np.asarray(np.maximum(np.maximum(old.pace.force, given), roundoff))

    def evaluate(self, a: FloatArray, problem: StepProblem) -> Trial:
        """Residual of the equation at a (n_dof, n_case) m/s^2."""
        h, s, dynamics = self.step, self.scheme, self.dynamics
        inertia, stiffness = dynamics.linear(a)
        u, v = displaced((problem.u0, problem.v0), a, (h * h * s.beta, h * s.gamma))
        contact = dynamics.contact(u, problem.slip)
        force, viscous, strain = dynamics.model.cell_forces(u, v, dynamics.beta)
        at = (u, inertia, stiffness, self.correct_inertia(a), dynamics.contact_force(contact), viscous)
        given = (problem.constant, problem.linear, dynamics.mask)
        damping, residual, energy = balanced(at, given, self._weights, force)
        return Trial(force, viscous, inertia, damping, strain + energy, contact, residual)

    def finish(
        self, old: MotionState, problem: StepProblem, solved: SolvedStep, loads: tuple[FloatArray, FloatArray]
    ) -> StepRecord:
        """The record at the end of the step; the pace of the state is still that of its beginning."""
        h, s = self.step, self.scheme
        a = solved.a
        inertia_a, damping_a = solved.inertia_a, solved.damping_a
        damping_v0 = old.damping_v + h * (1.0 - s.gamma) * old.damping_a
        u = problem.u0 + h * h * s.beta * a
        new = replace(
            old,
            u=u,
            v=problem.v0 + h * s.gamma * a,
            a=a,
            force=solved.force,
            viscous=solved.viscous,
            inertia_a=inertia_a,
            damping_a=damping_a,
            inertia_v=old.inertia_v + h * ((1.0 - s.gamma) * old.inertia_a + s.gamma * inertia_a),
            damping_v=damping_v0 + h * s.gamma * damping_a,
            slip=solved.contact.slip,
            history=np.concatenate([u[None], old.history[: KEPT - 1]]),
        )
        record = self._record(old, new, (solved.strain, solved.contact), loads, a - old.a)
        return replace(record, effort=Effort(solved.iterations, substeps=1))

    def between(
        self, old: MotionState, new: MotionState, share: float, loads: tuple[FloatArray, FloatArray]
    ) -> StepRecord:
        """The record inside a step, at the ``share`` of it, by the scheme's own formulas with a that varies linearly.

        u = u_n + s h v_n + s^2 h^2 (a_n/2 + b s (a_(n+1) - a_n)), v = v_n + s h (a_n + g s (a_(n+1) - a_n)): the exact
        end values at s = 1; in between of third order in h, like one step. ``loads`` at the beginning and here.
        """
        h, s, dynamics = share * self.step, self.scheme, self.dynamics
        rise = share * (new.a - old.a)
        u = old.u + h * old.v + h * h * (0.5 * old.a + s.beta * rise)
        v = old.v + h * (old.a + s.gamma * rise)
        a = old.a + rise
        contact = dynamics.contact(u, old.slip)
        force, viscous, strain = dynamics.forces(u, v, contact)
        inertia_a, damping_a = dynamics.mass_and_damping(a)
        inertia_v, damping_v = dynamics.mass_and_damping(v)
        mid = replace(
            old,
            u=u,
            v=v,
            a=a,
            force=force,
            viscous=viscous,
            inertia_a=inertia_a,
            damping_a=damping_a,
            inertia_v=inertia_v,
            damping_v=damping_v,
            slip=contact.slip,
        )
        return self._record(old, mid, (strain, contact), loads, new.a - old.a)

    def _record(
        self,
        old: MotionState,
        new: MotionState,
        found: tuple[FloatArray, ContactState],
        loads: tuple[FloatArray, FloatArray],
        rise: FloatArray,
    ) -> StepRecord:
        """The record of a state without the effort; ``rise`` (n_dof, n_case) is that of a over the whole step."""
        strain, contact = found
        new = replace(new, work=old.work + self._increment(old, new, contact, loads))
        # With the inertia of the dispersion correction: it makes up for what the velocities of the scheme overshoot.
        inertia_v = new.inertia_v + self.correct_inertia(new.v)
        energies = self.dynamics.energies(inertia_v, new, strain, contact)
        net = (loads[1] - new.force - new.viscous - new.damping_v) * self.dynamics.mask
        held = self.dynamics.support_force(new, self.scheme.timely(new.a, rise), loads[1])
        return StepRecord(new, contact, energies, net, held, Effort.none(new.u.shape[1]), new)

    def _increment(
        self, old: MotionState, new: MotionState, contact: ContactState, loads: tuple[FloatArray, FloatArray]
    ) -> FloatArray:
        """Friction, damping and external work of one step, (3, n_case) J.

        The last two by the forces that the scheme itself applies, weighted with alpha_f: for a linear structure and
        rho = 1 the ledger then closes to the tolerance of the steps.
        """
        af, (p_old, p_new) = self.scheme.alpha_f, loads
        damping = (1.0 - af) * (new.damping_v + new.viscous) + af * (old.damping_v + old.viscous)
        friction = self.dynamics.model.contact.dissipated(contact.traction, old.slip, contact.slip)
        load = (1.0 - af) * p_new + af * p_old
        damped, given = (np.einsum("nc,nc->c", force, new.u - old.u) for force in (damping, load))
        given = given + self.dynamics.follower_work(old.u, new.u, 1.0 - af)
        given = given + self.dynamics.support_work(old, new, (self.scheme.alpha_m, af), load)
        return np.stack([friction, damped, given])
