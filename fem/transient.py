"""Ring-downs and forced transients by the generalised-alpha method, several cases marching together.

Chung & Hulbert, J. Appl. Mech. 60 (1993) 371-375:

    M a_(n+1-am) + C v_(n+1-af) + (1-af) f_(n+1) + af f_n = (1-af) p_(n+1) + af p_n
    u_(n+1) = u_n + h v_n + h^2 ((1/2-b) a_n + b a_(n+1)),   v_(n+1) = v_n + h ((1-g) a_n + g a_(n+1))

The unknown is a_(n+1). One factor of the iteration matrix at the preloaded, stuck state serves all steps and all cases
as preconditioner inside Anderson acceleration, so that its precision never enters the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fem.anderson import Anderson
from fem.arrays import FloatArray
from fem.contact import ContactState
from fem.corotation import NodalRotation, rotate
from fem.errors import FemConvergenceError
from fem.generalized_alpha import Scheme
from fem.linear_solver import LinearSolver, make_solver
from fem.model import Model
from fem.modes import ModalBasis, Rayleigh
from fem.motion import MotionState, SolvedStep, StepRecord, extrapolated
from fem.preload import StaticState
from fem.sparse_product import SparseProduct

DIVERGED = 1e12
"""Residual over the peak inertia force beyond which iterating on is pointless and overflows single precision."""

Excitation = Callable[[float], FloatArray]


@dataclass(frozen=True)
class TransientSettings:
    """How to march.

    Attributes
    ----------
    time_step : s.
    spectral_radius : of generalised-alpha at infinite frequency.
    tolerance : residual relative to ``force_scale`` at which a step counts as solved.
    max_iterations : per step; more raise.
    depth : pairs kept by Anderson acceleration.
    dispersion_correction : give the first modes ``corrected_modes`` the inertia with which the scheme oscillates at
        their true frequency; the error in their frequency is then of fourth instead of second order in the step.
    corrected_modes : how many.
    solver : linear solver by name.
    """

    time_step: float
    spectral_radius: float = 0.9
    tolerance: float = 1e-4
    max_iterations: int = 60
    depth: int = 6
    dispersion_correction: bool = True
    corrected_modes: int = 2
    solver: str = "auto"


class Transient:
    """A model, its equilibrium and damping, ready to march from any motion.

    Parameters
    ----------
    force_scale : N, to which residuals are compared: peak inertia force of the intended motion.
    base_acceleration : t -> (n_case,) m/s^2 along ``base_direction``, or None.

    ``rest_energies`` (3, 1) J are kinetic, strain and contact energy of the equilibrium.
    """

    def __init__(
        self,
        model: Model,
        equilibrium: StaticState,
        modes: ModalBasis,
        damping: Rayleigh,
        settings: TransientSettings,
        *,
        force_scale: float,
        base_acceleration: Excitation | None = None,
        base_direction: str = "y",
    ) -> None:
        self.model, self.equilibrium, self.settings = model, equilibrium, settings
        self.scheme = Scheme.from_radius(settings.spectral_radius)
        self._scale = force_scale
        self._base = base_acceleration
        self._inertia_load = -(model.mass @ model.direction(base_direction))
        self._mask = model.free[:, None].astype(float)
        h, s = settings.time_step, self.scheme
        self._beta = damping.beta
        # What is linear in a_(n+1) acts through one matrix: mass, its damping, and the damping of the linear bodies.
        damping_matrix = damping.alpha * model.mass + damping.beta * model.stiffness
        linear = (1.0 - s.alpha_m) * model.mass + (1.0 - s.alpha_f) * h * s.gamma * damping_matrix
        self._mass = SparseProduct(model.mass)
        self._damping = SparseProduct(damping_matrix)
        self._linear = SparseProduct(linear)
        contact = model.contact.stick_tangent(equilibrium.contact.status[:, 0])
        viscous = damping.beta * (modes.material - model.stiffness)
        matrix = linear + (1.0 - s.alpha_f) * h * (s.gamma * viscous + h * s.beta * (modes.stiffness + contact))
        self._solver = self._factor(model.constrain(matrix))
        self._gap = SparseProduct(model.contact.operator)
        self._pull = SparseProduct(model.contact.operator.T.tocsr())
        self._correction = self._modal_inertia(modes)
        self._rotation = NodalRotation(model)
        rest = equilibrium.u[:, None]
        strain = self._forces(rest, np.zeros_like(rest), equilibrium.contact)[2]
        stored = model.contact.stored_energy(equilibrium.contact.traction)
        self.rest_energies = np.stack([np.zeros(1), strain, stored])

    def _factor(self, matrix: sp.csr_matrix) -> LinearSolver:
        solver = make_solver(self.settings.solver, symmetric=True, single=True)
        solver.analyse(matrix)
        solver.factor(matrix)
        return solver

    def _modal_inertia(self, modes: ModalBasis) -> tuple[FloatArray, FloatArray]:
        """Left vectors M phi_j and the relative inertia by which each corrected mode differs, (n_dof, k) and (k,)."""
        count = self.settings.corrected_modes if self.settings.dispersion_correction else 0
        h = self.settings.time_step
        ratios = [self.scheme.frequency_corrected_inertia(float(omega), h) for omega in modes.omega[:count]]
        return modes.left[:, :count], np.array(ratios)

    def start(self, displacement: FloatArray, velocity: FloatArray, slip: FloatArray | None = None) -> MotionState:
        """State at t = 0 for displacement from the equilibrium and velocity, both (n_dof, n_case).

        The slip history (n_point, 2, n_case) defaults to that of the equilibrium; the acceleration solves M a = p - f -
        C v.
        """
        n_case = displacement.shape[1]
        u = self.equilibrium.u[:, None] + displacement * self._mask
        v = velocity * self._mask
        if slip is None:
            slip = np.repeat(self.equilibrium.contact.slip, n_case, axis=2)
        contact = self.model.contact.evaluate(self._gap(u), slip)
        force, viscous, _ = self._forces(u, v, contact)
        damping_v = self._damping(v)
        net = (self._load(0.0, n_case) - force - viscous - damping_v) * self._mask
        solver = make_solver(self.settings.solver, symmetric=True)
        mass = self.model.constrain(self.model.mass)
        solver.analyse(mass)
        solver.factor(mass)
        a = solver.solve(net)
        products = (self._mass(a), self._damping(a), self._mass(v), damping_v)
        return MotionState(0, u, v, a, force, viscous, *products, contact.slip, u[None].copy(), np.zeros((3, n_case)))

    def observe(self, state: MotionState) -> StepRecord:
        """The record of a state that no step led to (t = 0)."""
        contact = self.model.contact.evaluate(self._gap(state.u), state.slip)
        n_case = state.u.shape[1]
        force, viscous, strain = self._forces(state.u, state.v, contact)
        load = self._load(state.step * self.settings.time_step, n_case)
        net = (load - force - viscous - state.damping_v) * self._mask
        return StepRecord(state, contact, self._energies(state, strain, contact), net, np.zeros(n_case, dtype=np.int64))

    def march(self, state: MotionState, n_step: int) -> Iterator[StepRecord]:
        """Yield ``n_step`` steps from ``state``.

        A step that does not converge raises ``FemConvergenceError`` with its residual history; what was yielded is
        good.
        """
        anderson = Anderson(self.model.n_dof, state.u.shape[1], self.settings.depth)
        for _ in range(n_step):
            record = self._advance(state, anderson)
            state = record.state
            yield record

    def precondition(self, residual: FloatArray) -> FloatArray:
        """Acceleration correction A^-1 r of the frozen factor, (n_dof, n_case) from forces (n_dof, n_case)."""
        return self._solver.solve(residual)

    def _advance(self, old: MotionState, anderson: Anderson) -> StepRecord:
        h, s = self.settings.time_step, self.scheme
        n_case = old.u.shape[1]
        u0 = old.u + h * old.v + h * h * (0.5 - s.beta) * old.a
        p_old, p_new = self._load(old.step * h, n_case), self._load((old.step + 1) * h, n_case)
        damping_v0 = old.damping_v + h * (1.0 - s.gamma) * old.damping_a
        constant = (
            s.alpha_m * (old.inertia_a + self._correct_inertia(old.a))
            + (1.0 - s.alpha_f) * damping_v0
            + s.alpha_f * (old.damping_v + old.force + old.viscous - p_old)
            - (1.0 - s.alpha_f) * p_new
        )
        v0 = old.v + h * (1.0 - s.gamma) * old.a
        solved = self._correct(u0, v0, constant, old, anderson)
        a, contact = solved.a, solved.contact
        inertia_a, damping_a = self._mass(a), self._damping(a)
        new = MotionState(
            step=old.step + 1,
            u=u0 + h * h * s.beta * a,
            v=v0 + h * s.gamma * a,
            a=a,
            force=solved.force,
            viscous=solved.viscous,
            inertia_a=inertia_a,
            damping_a=damping_a,
            inertia_v=old.inertia_v + h * ((1.0 - s.gamma) * old.inertia_a + s.gamma * inertia_a),
            damping_v=damping_v0 + h * s.gamma * damping_a,
            slip=contact.slip,
            history=old.history,
            work=old.work,
        )
        new = replace(
            new,
            history=np.concatenate([new.u[None], old.history[:2]]),
            work=old.work + self._increment(old, new, contact, p_old, p_new),
        )
        net = (p_new - solved.force - solved.viscous - new.damping_v) * self._mask
        return StepRecord(new, contact, self._energies(new, solved.strain, contact), net, solved.iterations)

    def _correct(
        self, u0: FloatArray, v0: FloatArray, constant: FloatArray, old: MotionState, anderson: Anderson
    ) -> SolvedStep:
        """Anderson-accelerated iteration on r(a) = L a + (1-af) f(u0 + b h^2 a, v0 + g h a) + constant = 0."""
        h, s = self.settings.time_step, self.scheme
        a = (extrapolated(old.history, old.v * h) - u0) / (h * h * s.beta)
        iterations = np.zeros(a.shape[1], dtype=np.int64)
        anderson.forget()
        step = previous = None
        w = self._rotation(u0 + h * h * s.beta * a - self.equilibrium.u[:, None])
        history: list[float] = []
        for _ in range(self.settings.max_iterations):
            u = u0 + h * h * s.beta * a
            contact = self.model.contact.evaluate(self._gap(u), old.slip)
            force, viscous, strain = self._forces(u, v0 + h * s.gamma * a, contact)
            inertia = self._linear(a) + (1.0 - s.alpha_m) * self._correct_inertia(a)
            residual = (inertia + (1.0 - s.alpha_f) * (force + viscous) + constant) * self._mask
            size = np.sqrt(np.einsum("nc,nc->c", residual, residual)) / self._scale
            history.append(float(size.max()))
            active = ~(size <= self.settings.tolerance)
            if not active.any():
                return SolvedStep(a, force, viscous, strain, contact, iterations)
            if not history[-1] < DIVERGED:
                break
            correction = -rotate(w, 1.0, self.precondition(rotate(w, -1.0, residual))) * self._mask
            if step is not None and previous is not None:
                anderson.remember(active, step, correction - previous)
            step = anderson.step(active, correction)
            previous = correction
            a = a + step
            iterations += active
        raise FemConvergenceError(
            "time step does not converge",
            where=f"step {old.step + 1}",
            value=f"relative residual {history[-1]:.2e}",
            advice="use a smaller time step, a smaller amplitude, or a start that has settled (snap-back)",
            history=tuple(history),
        )

    def _correct_inertia(self, a: FloatArray) -> FloatArray:
        """The low-rank inertia of the dispersion correction, sum_j M phi_j r_j phi_j' M a."""
        left, ratio = self._correction
        return np.asarray(left @ (ratio[:, None] * (left.T @ a)))

    def _forces(self, u: FloatArray, v: FloatArray, contact: ContactState) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Elastic plus contact force, viscous force of the Green-Lagrange bodies, strain energy."""
        elastic, viscous, strain = self.model.body_forces(u, v, self._beta)
        weighted = np.repeat(self.model.contact.area, 3)[:, None] * contact.traction
        return elastic + self._pull(weighted), viscous, strain

    def _load(self, t: float, n_case: int) -> FloatArray:
        load = np.repeat(self.model.load[:, None], n_case, axis=1)
        return load if self._base is None else load + np.outer(self._inertia_load, self._base(t))

    def _energies(self, state: MotionState, strain: FloatArray, contact: ContactState) -> FloatArray:
        # With the inertia of the dispersion correction: it makes up for what the velocities of the scheme overshoot.
        inertia_v = state.inertia_v + self._correct_inertia(state.v)
        kinetic = 0.5 * np.einsum("nc,nc->c", state.v, inertia_v)
        return np.stack([kinetic, strain, self.model.contact.stored_energy(contact.traction)])

    def _increment(
        self, old: MotionState, new: MotionState, contact: ContactState, p_old: FloatArray, p_new: FloatArray
    ) -> FloatArray:
        """Friction, damping and external work of one step, (3, n_case) J.

        The last two by the forces that the scheme itself applies, weighted with alpha_f: for a linear structure and
        rho = 1 the ledger then closes to the tolerance of the steps.
        """
        af = self.scheme.alpha_f
        damping = (1.0 - af) * (new.damping_v + new.viscous) + af * (old.damping_v + old.viscous)
        friction = self.model.contact.dissipated(contact.traction, old.slip, contact.slip)
        work = [np.einsum("nc,nc->c", force, new.u - old.u) for force in (damping, (1.0 - af) * p_new + af * p_old)]
        return np.stack([friction, *work])
