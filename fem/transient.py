"""Ring-downs and forced transients by the generalised-alpha method, several cases marching together.

The equation of a step is in ``step_equation``; it is solved for a_(n+1) by Anderson acceleration on a frozen factor or
by full Newton (``corrector``). A step that does not converge, or whose local error is too large, is halved; the march
comes back to the uniform output grid by itself (``step_control``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem.anderson import Anderson
from fem.arrays import FloatArray
from fem.bounds import real, require, require_count
from fem.corrector import Corrector
from fem.dynamics import Dynamics
from fem.errors import FemConvergenceError, FemInputError
from fem.excitation import Amplitude, SupportMotion, TimeLoad, base_load
from fem.generalized_alpha import Scheme
from fem.interface_equilibrium import LoosePoints
from fem.linear_solver import SolverStatistics
from fem.model import Model
from fem.modes import ModalBasis, Rayleigh
from fem.motion import Effort, MotionState, SolvedStep, StepRecord, extrapolated
from fem.preconditioner import Preconditioner
from fem.preload import StaticState
from fem.roundoff import rounding_force
from fem.step_control import StepControl, modal_deflection, rescaled, too_small
from fem.step_equation import StepEquation, StepProblem

METHODS = ("anderson", "newton")


@dataclass(frozen=True)
class TransientSettings:
    """How to march.

    Attributes
    ----------
    time_step : s, distance of the outputs and, unless halved or doubled, of the steps.
    spectral_radius : of generalised-alpha at infinite frequency.
    tolerance : residual at which a step counts as solved, relative to the force that ``Transient`` names.
    max_iterations : per step; more halve it.
    depth : pairs kept by Anderson acceleration.
    dispersion_correction : give the first modes ``corrected_modes`` the inertia with which the scheme oscillates at
        their true frequency; the error in their frequency is then of fourth instead of second order in the step. Not
        with adaptive steps.
    corrected_modes : how many.
    solver : linear solver by name.
    method : "anderson" on a frozen factor, or "newton" with the consistent tangent factored in every iteration.
    refactor_above : iterations of a step above which a case gets a factor of its current tangent; 0: never. Each such
        case keeps a factor of its own in memory.
    interface_equilibrium : find the equilibrium of the contact points that slip or open apart in every iteration,
        see ``interface_equilibrium``; fewer iterations to the same residual.
    max_cutbacks : most halvings of ``time_step``, for convergence or for the local error.
    error_tolerance : local error of a step in the mass norm of the displacement, relative to the largest so far or to
        what the load deflects; None: fixed steps.
    max_doublings : most doublings of ``time_step`` where the local error allows; outputs inside a step are
        interpolated.
    """

    time_step: float
    spectral_radius: float = 0.9
    tolerance: float = 1e-4
    max_iterations: int = 60
    depth: int = 6
    dispersion_correction: bool = True
    corrected_modes: int = 2
    solver: str = "auto"
    method: str = "anderson"
    refactor_above: int = 15
    interface_equilibrium: bool = True
    max_cutbacks: int = 6
    error_tolerance: float | None = None
    max_doublings: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < real(self.time_step) < math.inf:
            raise FemInputError("time step must be positive and finite", where="transient", value=self.time_step)
        for name in ("depth", "max_iterations"):
            require_count("transient", name, getattr(self, name), 1)
        for name in ("max_cutbacks", "max_doublings", "corrected_modes", "refactor_above"):
            require_count("transient", name, getattr(self, name), 0)
        require("transient", "tolerance", self.tolerance, 0.0, above=True)
        require("transient", "spectral_radius", self.spectral_radius, 0.0, most=1.0)
        if self.method not in METHODS:
            advice = f"choose one of {', '.join(METHODS)}"
            raise FemInputError("unknown method", where="transient", value=self.method, advice=advice)
        if self.error_tolerance is not None and not 0.0 < real(self.error_tolerance) < math.inf:
            raise FemInputError("error tolerance must be positive", where="transient", value=self.error_tolerance)


class Transient:
    """A model, its equilibrium and damping, ready to march from any motion.

    Parameters
    ----------
    force_scale : N, to which residuals are compared, such as the peak inertia force of the intended motion; None: the
        largest inertia force or load of the case so far, this step included.
    loads : forces that follow a function of time, on top of the dead loads of the model.
    motions : supports that follow a function of time, see ``support_motion``.
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
        force_scale: float | None = None,
        loads: Sequence[TimeLoad] = (),
        motions: Sequence[SupportMotion] = (),
        base_acceleration: Amplitude | None = None,
        base_direction: str = "y",
    ) -> None:
        if force_scale is not None:
            require("transient", "force_scale", force_scale, 0.0, above=True)
        self.model, self.equilibrium, self.settings = model, equilibrium, settings
        self.scheme = Scheme.from_radius(settings.spectral_radius)
        base = () if base_acceleration is None else (base_load(model, base_direction, base_acceleration),)
        self.dynamics = Dynamics(model, equilibrium, damping, (*loads, *base), motions)
        self.rest_energies = self.dynamics.rest_energies
        self._correction = self._modal_inertia(modes)
        self._equations: dict[int, StepEquation] = {}
        self._modes = modes
        self._rounding = rounding_force(model, equilibrium.u, equilibrium.contact.slip[:, :, 0])
        self._corrector = Corrector(settings.tolerance, force_scale, settings.max_iterations, self._rounding)
        self._control = StepControl(
            settings.max_cutbacks,
            0 if settings.error_tolerance is None else -settings.max_doublings,
            settings.error_tolerance,
            settings.max_iterations,
            settings.refactor_above if settings.method == "anderson" else 0,
            settings.method == "anderson" and settings.interface_equilibrium,
        )
        self._preconditioner = Preconditioner(self._equation, modes, settings.solver)
        if settings.method == "anderson":
            self._preconditioner.rest(0)

    def start(
        self, displacement: FloatArray, velocity: FloatArray, slip: FloatArray | None = None, *, settled: bool = False
    ) -> MotionState:
        """State at t = 0 for displacement from the equilibrium and velocity, both (n_dof, n_case).

        The slip history (n_point, 2, n_case) defaults to that of the equilibrium. ``settled`` starts, where only slow
        modes are out of balance, take the acceleration from M a = p - f - C v. All others take
        (M + c h^2 K) a = p - f - C v, which leaves slow modes alone to O((omega h)^2) and quiets those that the step
        does not resolve: they have a double root, so that what they start with grows as n rho^n before it decays.
        """
        dynamics, step = self.dynamics, self.settings.time_step
        state = dynamics.start(displacement, velocity, slip, self.settings.solver, step)
        if settled:
            return state
        solve = self._preconditioner.prepare(0, state.pace, state.u)
        supports = state.a * (1.0 - dynamics.mask)
        net = (state.inertia_a - dynamics.mass(supports)) * dynamics.mask
        a = (1.0 - self.scheme.alpha_m) * solve(net, np.arange(net.shape[1])) * dynamics.mask + supports
        inertia_a, damping_a = dynamics.mass_and_damping(a)
        return replace(state, a=a, inertia_a=inertia_a, damping_a=damping_a)

    def observe(self, state: MotionState) -> StepRecord:
        """The record of a state that no step led to (t = 0)."""
        contact = self.dynamics.contact(state.u, state.slip)
        n_case = state.u.shape[1]
        force, viscous, strain = self.dynamics.forces(state.u, state.v, contact)
        load = self.dynamics.load(state.pace.position * self.settings.time_step, n_case)
        net = (load - force - viscous - state.damping_v) * self.dynamics.mask
        inertia_v = state.inertia_v + self._equation(state.pace.last_level).correct_inertia(state.v)
        energies = self.dynamics.energies(inertia_v, state, strain, contact)
        rise = self.settings.time_step * 2.0**-state.pace.last_level * state.pace.jerk
        held = self.dynamics.support_force(state, self.scheme.timely(state.a, rise), load)
        return StepRecord(state, contact, energies, net, held, Effort.none(n_case), state)

    def march(self, state: MotionState, n_step: int) -> Iterator[StepRecord]:
        """Yield ``n_step`` outputs from ``state``, one per ``time_step``.

        A step that converges at no allowed size raises ``FemConvergenceError`` with its residual history; what was
        yielded is good. March on from ``resume`` of the last record.
        """
        require_count("transient", "n_step", n_step, 0)
        n_case, end = state.u.shape[1], state.step + n_step
        anderson = Anderson(self.model.n_dof, n_case, self.settings.depth)
        effort = Effort.none(n_case)
        while state.step < end:
            record, level = self._accepted(state, anderson)
            new = record.state
            # After a restart inside a long step its effort belongs to the outputs before.
            effort = effort + (record.effort if state.step <= state.pace.position else Effort.none(n_case))
            for number in range(state.step + 1, min(end, new.step) + 1):
                at = record if number == new.pace.position else self._between(state, new, level, number)
                yield replace(at, effort=effort)
                effort = Effort.none(n_case)
            state = new

    @property
    def statistics(self) -> SolverStatistics:
        """Times, entries and memory of the factor that all cases share."""
        return self._preconditioner.rest(0).statistics

    def precondition(self, residual: FloatArray) -> FloatArray:
        """Acceleration correction A^-1 r of the frozen factor, (n_dof, n_case) from forces (n_dof, n_case)."""
        return self._preconditioner.rest(0).solve(residual)

    def loose(self, state: MotionState) -> LoosePoints | None:
        """The contact points of a state that come into equilibrium apart, on the factor that all cases share."""
        return self._preconditioner.loose(state.pace.loose)

    def _modal_inertia(self, modes: ModalBasis) -> tuple[FloatArray, FloatArray]:
        """Left vectors M phi_j and the relative inertia by which each corrected mode differs, (n_dof, k) and (k,).

        Steps of all sizes share it: an inertia that changed with the step would change the energy of the mode.
        """
        adaptive = self.settings.error_tolerance is not None
        count = self.settings.corrected_modes if self.settings.dispersion_correction and not adaptive else 0
        h = self.settings.time_step
        ratios = [self.scheme.frequency_corrected_inertia(float(omega), h) for omega in modes.omega[:count]]
        # Column by column: two products with it stand in every iteration.
        return np.asfortranarray(modes.left[:, :count]), np.array(ratios)

    def _equation(self, level: int) -> StepEquation:
        """The equation of steps of ``time_step`` / 2^level."""
        if level not in self._equations:
            step = self.settings.time_step * 2.0**-level
            self._equations[level] = StepEquation(self.dynamics, self.scheme, step, self._correction)
        return self._equations[level]

    def _accepted(self, state: MotionState, anderson: Anderson) -> tuple[StepRecord, int]:
        """One step of the largest size that converges within the error tolerance, and its level."""
        rejected, wasted = 0, np.zeros(state.u.shape[1], dtype=np.int64)
        for level in range(state.pace.level, self._control.finest + 1):
            equation = self._equation(level)
            old = rescaled(state, self.dynamics, self.scheme, self.settings.time_step, level)
            try:
                record = self._advance(equation, old, level, anderson)
            except FemConvergenceError as error:
                if level == self._control.finest:
                    raise
                wasted = wasted + max(len(error.history) - 1, 0)
                rejected += 1
                continue
            error_ratio = self._control.error(equation, old, record, self._deflection(old, level))
            if error_ratio <= 1.0:
                spent = Effort(wasted, rejected=rejected)
                paced = self._control.paced(self.dynamics, old, record, level, error_ratio)
                return replace(paced, effort=paced.effort + spent), level
            wasted = wasted + record.iterations
            rejected += 1
        raise too_small(state, error_ratio, equation.step)

    def _deflection(self, old: MotionState, level: int) -> FloatArray:
        """What local errors are at least compared with: deflection by the load there, by rounding over its share."""
        if self.settings.error_tolerance is None:
            return np.zeros(old.u.shape[1])
        end = (old.pace.position + 2.0**-level) * self.settings.time_step
        load = self.dynamics.load(end, old.u.shape[1]) - self.model.load[:, None]
        return modal_deflection(self._modes, load, self._rounding / self.settings.error_tolerance)

    def _advance(self, equation: StepEquation, old: MotionState, level: int, anderson: Anderson) -> StepRecord:
        n_case, h, position = old.u.shape[1], self.settings.time_step, old.pace.position
        end = (position + 2.0**-level) * h
        loads = (self.dynamics.load(position * h, n_case), self.dynamics.load(end, n_case))
        guess = self.dynamics.held(extrapolated(old.history, old.v * equation.step), end)
        problem = equation.problem(old, guess, loads)
        record = equation.finish(old, problem, self._solve(equation, problem, level, old, anderson), loads)
        jerk = (record.state.a - old.a) / equation.step
        state = replace(record.state, pace=replace(old.pace, jerk=jerk))
        return replace(record, state=state)

    def _solve(
        self, equation: StepEquation, problem: StepProblem, level: int, old: MotionState, anderson: Anderson
    ) -> SolvedStep:
        if self.settings.method == "newton":
            return self._corrector.newton(equation, problem, self.settings.solver)
        u = problem.u0 + equation.step**2 * self.scheme.beta * problem.guess
        solve = self._preconditioner.prepare(level, old.pace, u)
        # The compliance of the points belongs to the shared factor for whole intervals.
        shared = level == 0 and len(old.pace.anchored) < u.shape[1]
        loose = self.loose(old) if shared else None
        return self._corrector.accelerated(equation, problem, solve, anderson, loose, old.pace.anchored)

    def _between(self, state: MotionState, new: MotionState, level: int, number: int) -> StepRecord:
        """The output inside a step of several intervals, and where the march resumes: before that step."""
        h, n_case, position = self.settings.time_step, new.u.shape[1], state.pace.position
        old = rescaled(state, self.dynamics, self.scheme, h, level)
        loads = (self.dynamics.load(position * h, n_case), self.dynamics.load(number * h, n_case))
        record = self._equation(level).between(old, new, (number - position) * 2.0**level, loads)
        return replace(record, state=replace(record.state, step=number), resume=replace(state, step=number))
