"""Forces, energies and dissipated work of a structure in motion, whatever scheme marches it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem.arrays import FloatArray
from fem.bolt import warn_of_slack
from fem.contact import ContactState
from fem.errors import FemInputError
from fem.excitation import SupportMotion, TimeLoad
from fem.finite_values import finite_array
from fem.linear_operators import LinearOperators
from fem.linear_solver import make_solver
from fem.model import Model
from fem.modes import Rayleigh
from fem.motion import MotionState, Pace
from fem.preload import StaticState
from fem.sparse_product import SparseProduct
from fem.support_forces import SpringForces, SupportForces


class Dynamics:
    """M u'' + C u' + f_viscous(u, u') + f(u, slip) = p(t), with the operators that every scheme needs.

    C = alpha M + beta K_linear is the linear part of the damping; the viscous force of the Green-Lagrange bodies
    belongs to the forces. ``rest_energies`` (3, 1) J are kinetic, strain and contact energy of the equilibrium.
    """

    def __init__(
        self,
        model: Model,
        equilibrium: StaticState,
        damping: Rayleigh,
        loads: Sequence[TimeLoad] = (),
        motions: Sequence[SupportMotion] = (),
    ) -> None:
        equilibrium.check_belongs(model)
        warn_of_slack(model.bolts, "transient")
        _check_time_functions(model, loads, TimeLoad, "time_load")
        _check_time_functions(model, motions, SupportMotion, "support_motion")
        self.model, self.equilibrium, self.loads, self.motions = model, equilibrium, tuple(loads), tuple(motions)
        self.alpha, self.beta = damping.alpha, damping.beta
        self.mask = model.free[:, None].astype(float)
        self.damping_matrix = damping.alpha * model.mass + damping.beta * model.stiffness
        self.linear = LinearOperators(model.mass, model.stiffness)
        self.support_force, self.spring_force = SupportForces(model), SpringForces(model, damping.beta)
        self._gap = SparseProduct(model.contact.operator)
        self._pull = SparseProduct(model.contact.operator.T.tocsr())
        rest = equilibrium.u[:, None]
        strain = self.forces(rest, np.zeros_like(rest), equilibrium.contact)[2]
        stored = model.contact.stored_energy(equilibrium.contact.traction)
        self.rest_energies = np.stack([np.zeros(1), strain, stored])

    def mass(self, x: FloatArray) -> FloatArray:
        """M x (n_dof, n_case)."""
        return self.linear(x)[0]

    def damping(self, x: FloatArray) -> FloatArray:
        """C x (n_dof, n_case)."""
        return self.mass_and_damping(x)[1]

    def mass_and_damping(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M x and C x, each (n_dof, n_case)."""
        mass_x, stiffness_x = self.linear(x)
        return mass_x, self.alpha * mass_x + self.beta * stiffness_x

    def contact(self, u: FloatArray, slip: FloatArray) -> ContactState:
        """State of the interfaces at u (n_dof, n_case) after the history ``slip`` (n_point, 2, n_case)."""
        return self.model.contact.evaluate(self._gap(u), slip)

    def forces(self, u: FloatArray, v: FloatArray, contact: ContactState) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Elastic plus contact force, viscous force of the Green-Lagrange bodies (n_dof, n_case), strain energy."""
        elastic, viscous, strain = self.model.body_forces(u, v, self.beta)
        return elastic + self.contact_force(contact), viscous, strain

    def contact_force(self, contact: ContactState) -> FloatArray:
        """Nodal forces of the interfaces, (n_dof, n_case) N."""
        return self._pull(np.repeat(self.model.contact.area, 3)[:, None] * contact.traction)

    def load(self, t: float, n_case: int) -> FloatArray:
        """p(t) (n_dof, n_case) N: the dead loads of the model and all time functions."""
        load = np.repeat(self.model.load[:, None], n_case, axis=1)
        for part in self.loads:
            load = load + np.outer(part.pattern, part.at(t, n_case))
        return load

    def held(self, u: FloatArray, t: float) -> FloatArray:
        """u (n_dof, n_case) with the supports where their motions have them at t."""
        if not self.motions:
            return u
        given = np.repeat(self.equilibrium.u[:, None], u.shape[1], axis=1)
        for motion in self.motions:
            given += np.outer(motion.pattern, motion.at(t, u.shape[1]))
        return np.where(self.mask > 0.0, u, given)

    def follower_work(self, old: FloatArray, new: FloatArray, share: float) -> FloatArray:
        """Work (n_case,) J of the follower pressures on the way to ``new``, by ``share`` of their force there."""
        followers = self.model.followers
        if not followers.any:
            return np.zeros(new.shape[1])
        force = share * followers.force(new) + (1.0 - share) * followers.force(old)
        return np.asarray(np.einsum("nc,nc->c", force, new - old))

    def support_work(
        self, old: MotionState, new: MotionState, weights: tuple[float, float], load: FloatArray
    ) -> FloatArray:
        """Work (n_case,) J that moving supports do in a step, by the reactions M a + C v + f - p of the scheme.

        weights : alpha_m and alpha_f of the scheme; load (n_dof, n_case) N at alpha_f.
        """
        if not self.motions:
            return np.zeros(new.u.shape[1])
        am, af = weights
        inertia = (1.0 - am) * new.inertia_a + am * old.inertia_a
        new_force, old_force = (s.damping_v + s.force + s.viscous for s in (new, old))
        reaction = inertia + (1.0 - af) * new_force + af * old_force - load
        return np.asarray(np.einsum("nc,nc->c", (1.0 - self.mask) * reaction, new.u - old.u))

    def start(
        self,
        displacement: FloatArray,
        velocity: FloatArray,
        slip: FloatArray | None,
        solver: str,
        step: float,
    ) -> MotionState:
        """State at t = 0 for displacement from the equilibrium and velocity: M a = p - f - C v.

        step : s, over which the rates of moving supports are taken.
        """
        displacement, velocity, slip = self._checked(displacement, velocity, slip)
        n_case = displacement.shape[1]
        moved_v, moved_a = self._support_rates(step, n_case)
        u = self.equilibrium.u[:, None] + displacement * self.mask
        v = velocity * self.mask + moved_v
        contact = self.contact(u, slip)
        force, viscous, _ = self.forces(u, v, contact)
        net = (self.load(0.0, n_case) - force - viscous - self.damping(v) - self.mass(moved_a)) * self.mask
        direct = make_solver(solver, symmetric=True)
        mass = self.model.constrain(self.model.mass)
        direct.analyse(mass)
        direct.factor(mass)
        return self.at_rest(u, v, direct.solve(net) + moved_a, (force, viscous), contact)

    def _checked(
        self, displacement: FloatArray, velocity: FloatArray, slip: FloatArray | None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The start as finite arrays of one number of cases, with the slip of the equilibrium where none is given."""
        where, n_dof = "start of the motion", self.model.n_dof
        advice = f"give ({n_dof}, n_case) numbers: one column for each case"
        displacement = finite_array(displacement, (n_dof, -1), "the displacement", where=where, advice=advice)
        shape = displacement.shape
        velocity = finite_array(velocity, shape, "the velocity", where=where, advice=f"give {shape} numbers")
        if slip is None:
            return displacement, velocity, np.repeat(self.equilibrium.contact.slip, shape[1], axis=2)
        shape = (self.model.contact.n_point, 2, shape[1])
        return (
            displacement,
            velocity,
            finite_array(slip, shape, "the slip", where=where, advice=f"give {shape} numbers"),
        )

    def _support_rates(self, step: float, n_case: int) -> tuple[FloatArray, FloatArray]:
        """Velocity and acceleration (n_dof, n_case) of the supports at t = 0."""
        v = np.zeros((self.model.n_dof, n_case))
        a = np.zeros_like(v)
        for motion in self.motions:
            first, second = motion.rates(step, n_case)
            v += np.outer(motion.pattern, first)
            a += np.outer(motion.pattern, second)
        return v, a

    def at_rest(
        self, u: FloatArray, v: FloatArray, a: FloatArray, forces: tuple[FloatArray, FloatArray], contact: ContactState
    ) -> MotionState:
        """The state from which a march starts at t = 0."""
        products = (*self.mass_and_damping(a), *self.mass_and_damping(v))
        pace = Pace.beginning(u, contact.slip, self.size(u), self.norm(products[0]))
        work = np.zeros((3, u.shape[1]))
        return MotionState(0, u, v, a, *forces, *products, contact.slip, u[None].copy(), work, pace)

    def norm(self, force: FloatArray) -> FloatArray:
        """Norm of a force (n_dof, n_case) over what no support holds, (n_case,) N."""
        return np.asarray(np.linalg.norm(force * self.mask, axis=0))

    def size(self, u: FloatArray) -> FloatArray:
        """Mass norm of the displacement from the equilibrium, (n_case,) m kg^0.5."""
        moved = u - self.equilibrium.u[:, None]
        return np.asarray(np.sqrt(np.einsum("nc,nc->c", moved, self.mass(moved))))

    def energies(
        self, inertia_v: FloatArray, state: MotionState, strain: FloatArray, contact: ContactState
    ) -> FloatArray:
        """Kinetic, strain and contact energy, (3, n_case) J, with M v as the scheme sees it."""
        kinetic = 0.5 * np.einsum("nc,nc->c", state.v, inertia_v)
        return np.stack([kinetic, strain, self.model.contact.stored_energy(contact.traction)])


def _check_time_functions(
    model: Model, given: Sequence[object], kind: type[TimeLoad | SupportMotion], door: str
) -> None:
    """Refuse what follows no function of time, or belongs to another model."""
    for item in given:
        if not isinstance(item, kind):
            advice = f"make it with {door}(model, ...)"
            raise FemInputError(f"not a {kind.__name__}", where="transient", value=type(item).__name__, advice=advice)
        finite_array(item.pattern, (model.n_dof,), "the nodal pattern", where=item.name)
