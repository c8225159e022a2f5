"""Explicit transients: central differences with lumped mass, several cases marching together.

    v_(n+1/2) = v_n + h/2 a_n,  u_(n+1) = u_n + h v_(n+1/2),  v_(n+1) = v_(n+1/2) + h/2 a_(n+1)
    M a_(n+1) = p_(n+1) - f(u_(n+1)) - C v_(n+1/2)

Belytschko, Liu, Moran, Nonlinear Finite Elements for Continua and Structures, sec. 6.2. Impact and waves are its field;
ring-downs of slender structures need steps a thousand times smaller than those of ``transient``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray
from fem.bounds import real, require_count
from fem.contact import ContactState
from fem.critical_step import critical_step
from fem.dynamics import Dynamics
from fem.errors import FemConvergenceError, FemInputError
from fem.excitation import Amplitude, TimeLoad, base_load
from fem.model import Model
from fem.modes import Rayleigh
from fem.motion import Effort, MotionState, StepRecord
from fem.preload import StaticState


@dataclass(frozen=True)
class ExplicitSettings:
    """How to march.

    Attributes
    ----------
    time_step : s, distance of the outputs.
    step : s, of the scheme; the nearest one below that divides ``time_step`` is taken. None: ``safety`` times the
        critical step of the equilibrium.
    safety : share of the critical step, for what stretching and closing interfaces take from it.
    solver : linear solver by name, for starts from static states.
    """

    time_step: float
    step: float | None = None
    safety: float = 0.9
    solver: str = "auto"

    def __post_init__(self) -> None:
        if not 0.0 < real(self.time_step) < math.inf:
            raise FemInputError(
                "time step must be positive and finite", where="explicit transient", value=self.time_step
            )
        if not 0.0 < real(self.safety) <= 1.0:
            raise FemInputError("safety must lie in (0, 1]", where="explicit transient", value=self.safety)


class ExplicitTransient:
    """A model, its equilibrium and damping, ready to march explicitly from any motion; outputs as ``Transient``.

    Parameters
    ----------
    loads, base_acceleration, base_direction : as for ``Transient``.

    Attributes
    ----------
    critical : s, largest stable step at the equilibrium; substeps : steps per output.

    A given step above the critical one raises ``FemInputError``.
    """

    def __init__(
        self,
        model: Model,
        equilibrium: StaticState,
        damping: Rayleigh,
        settings: ExplicitSettings,
        *,
        loads: Sequence[TimeLoad] = (),
        base_acceleration: Amplitude | None = None,
        base_direction: str = "y",
    ) -> None:
        self._mass = model.lumped_mass()
        self.critical = critical_step(model, equilibrium.u, self._mass, damping)
        step = settings.safety * self.critical if settings.step is None else settings.step
        if not 0.0 < step <= self.critical:
            raise FemInputError(
                "time step is unstable for central differences",
                where="explicit transient",
                value=f"{step:.3e} s",
                advice=f"the critical step of this mesh is {self.critical:.3e} s",
            )
        self.substeps = int(np.ceil(settings.time_step / step * (1.0 - 1e-12)))
        self.model = replace(model, mass=sp.diags(self._mass).tocsr())
        self.equilibrium, self.settings = equilibrium, settings
        base = () if base_acceleration is None else (base_load(self.model, base_direction, base_acceleration),)
        self.dynamics = Dynamics(self.model, equilibrium, damping, (*loads, *base))
        self.rest_energies = self.dynamics.rest_energies

    def start(
        self, displacement: FloatArray, velocity: FloatArray, slip: FloatArray | None = None, *, settled: bool = False
    ) -> MotionState:
        """State at t = 0 for displacement from the equilibrium and velocity, both (n_dof, n_case).

        All modes are resolved, ``settled`` or not.
        """
        return self.dynamics.start(displacement, velocity, slip, self.settings.solver, self.settings.time_step)

    def observe(self, state: MotionState) -> StepRecord:
        """The record of a state that no step led to (t = 0)."""
        contact = self.dynamics.contact(state.u, state.slip)
        strain = self.dynamics.forces(state.u, state.v, contact)[2]
        return self._record(state, contact, strain, 0)

    def march(self, state: MotionState, n_step: int) -> Iterator[StepRecord]:
        """Yield ``n_step`` outputs from ``state``; a march that blows up raises ``FemConvergenceError``."""
        require_count("transient", "n_step", n_step, 0)
        for _ in range(n_step):
            for number in range(1, self.substeps + 1):
                state, contact, strain = self._advance(state, state.step + number / self.substeps)
            step = state.step + 1
            if not np.isfinite(state.u).all():
                raise FemConvergenceError(
                    "explicit march blew up",
                    where=f"step {step}",
                    value=f"{self.settings.time_step / self.substeps:.3e} s per step",
                    advice="use a smaller safety: the structure stiffens as it moves",
                )
            state = replace(state, step=step, pace=replace(state.pace, position=float(step)))
            record = self._record(state, contact, strain, self.substeps)
            state = record.state
            yield record

    def _advance(self, old: MotionState, position: float) -> tuple[MotionState, ContactState, FloatArray]:
        """One step that ends at ``position`` output intervals; C v stays that of the middle of the step."""
        dynamics, h = self.dynamics, self.settings.time_step / self.substeps
        n_case = old.u.shape[1]
        t = position * self.settings.time_step
        middle = old.v + 0.5 * h * old.a
        u = old.u + h * middle
        contact = dynamics.contact(u, old.slip)
        force, viscous, strain = dynamics.forces(u, middle, contact)
        damping_v = dynamics.damping(middle)
        load = dynamics.load(t, n_case)
        a = (load - force - viscous - damping_v) * dynamics.mask / np.where(self.model.free, self._mass, 1.0)[:, None]
        # Trapezoidal work: what is left of the ledger stays bounded, h^2/8 a' M a.
        damped = 0.5 * (old.viscous + old.damping_v + viscous + damping_v)
        given = 0.5 * (dynamics.load(t - h, n_case) + load)
        friction = self.model.contact.dissipated(contact.traction, old.slip, contact.slip)
        work = [friction, *(np.einsum("nc,nc->c", p, u - old.u) for p in (damped, given))]
        work[2] = work[2] + dynamics.follower_work(old.u, u, 0.5)
        new = replace(
            old,
            u=u,
            v=middle + 0.5 * h * a,
            a=a,
            force=force,
            viscous=viscous,
            damping_v=damping_v,
            slip=contact.slip,
            work=old.work + np.stack(work),
        )
        return new, contact, strain

    def _record(self, state: MotionState, contact: ContactState, strain: FloatArray, substeps: int) -> StepRecord:
        inertia_a, inertia_v = self.dynamics.mass(state.a), self.dynamics.mass(state.v)
        state = replace(state, inertia_a=inertia_a, inertia_v=inertia_v, history=state.u[None])
        energies = self.dynamics.energies(inertia_v, state, strain, contact)
        effort = replace(Effort.none(state.u.shape[1]), substeps=substeps)
        load = self.dynamics.load(state.step * self.settings.time_step, state.u.shape[1])
        held = self.dynamics.support_force(state, state.a, load)
        return StepRecord(state, contact, energies, inertia_a, held, effort, state)
