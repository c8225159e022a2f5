"""Newton's method for one load step: bodies, contact with friction, moved supports, bolts being tightened.

Unknown are u (m) and, while bolts are tightened, their shortening delta (m):

    f_int(u) + f_contact(u, s_p) + Q' delta = p,    Q u + S delta = F

with the force Q u + S delta of every bolt section (``fem.bolt``). The tangent is consistent and unsymmetric in slip;
delta is eliminated. Whole steps come first; where they do not converge, the load step is tried again with steps that
are halved while the residual does not fall.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from fem.arrays import BoolArray, FloatArray
from fem.contact import ContactState
from fem.errors import FemConvergenceError, FemInputError
from fem.linear_solver import make_solver
from fem.model import Model
from fem.rigid_motion import loose_bodies, loose_drift, loose_motion
from fem.roundoff import is_rounding
from fem.tangent_solver import TangentSolver

_ROUNDOFF = 1e-14
"""Share of the forces inside a body that cancellation leaves in its residual."""

_LENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Lengths of the second attempt. The first takes whole steps: where a thin part turns, its membrane force makes the
residual grow before it falls, and halving by it would creep (14 iterations instead of 4 on a clamped strip)."""

LARGE = 30_000
"""Degrees of freedom from which GMRES on a symmetric factor beats a new unsymmetric factor in every iteration.

Spheres of 31,674: 10 s against 18 s for the pressing, one core."""

_TOUCH = 1e-6
"""Gap in facet sizes up to which surfaces touch: rounding of coordinates."""

_SLACK = 1e-9
"""Share of the stiffness of a bolt section that answers to tightening where nothing holds: rounding. Joints: 1e-5."""

_CLOSING_STEPS = 4
"""Attempts to bring surfaces together that must hold a loose body, before the interface counts as one that opens."""


@dataclass
class Tolerance:
    """Relative residual, the force in N that it is relative to, iterations per load step, linear solver by name."""

    residual: float
    scale: float
    max_iterations: int
    solver: str
    history: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Target:
    """Where a load step leads: load (n_dof,) N, motion of the supports (n_dof,) m, bolt forces (n_bolt,) N.

    ``bolts`` None keeps the shortening locked. ``touching`` starts with all points closed and stuck, since surfaces
    that just touch or that a gap divides carry nothing yet.
    """

    load: FloatArray
    moved: FloatArray
    bolts: FloatArray | None
    touching: bool


class _NeverClosesError(FemInputError):
    """Surfaces that must hold a part stay open when they are drawn together."""


@dataclass(frozen=True)
class Point:
    """One iterate: u (n_dof,), delta (n_bolt,), contact, residuals of the nodes (n_dof,) and bolts (n_bolt,) in N."""

    u: FloatArray
    shortening: FloatArray
    contact: ContactState
    residual: FloatArray
    bolt_residual: FloatArray

    @property
    def size(self) -> float:
        """Norm of both residuals, N."""
        return float(np.sqrt(self.residual @ self.residual + self.bolt_residual @ self.bolt_residual))


def internal_force(model: Model, u: FloatArray, slip: FloatArray) -> tuple[FloatArray, ContactState]:
    """Force of bodies, ties and contact at u (n_dof,) with the slip history (n_point, 2, 1), and the contact there."""
    state = model.contact.evaluate(model.contact.relative(u[:, None]), slip)
    force = model.elastic_force(u[:, None])[0] + model.contact.force(state.traction)
    return force[:, 0], state


class LoadStep:
    """One load step of a model from a displacement, a shortening of the bolts and a slip history."""

    def __init__(self, model: Model, target: Target, slip: FloatArray, tolerance: Tolerance) -> None:
        self.model, self.target, self._slip, self._tolerance = model, target, slip, tolerance
        self._closing = 0
        self._last: ContactState | None = None
        self._large = TangentSolver(np.empty((model.n_dof, 0)), tolerance.solver)

    def solve(self, u: FloatArray, shortening: FloatArray) -> Point:
        """Iterate from u (n_dof,) and shortening (n_bolt,) to balance.

        No convergence raises ``FemConvergenceError``; an interface that must hold a body but opens, ``FemInputError``.
        """
        try:
            found = self._newton(u, shortening, (1.0,)) or self._newton(u, shortening, _LENGTHS)
        except _NeverClosesError:
            near = self._approached(u, shortening)
            if near is None:
                raise
            self._closing, self.target = 0, replace(self.target, touching=False)
            found = self._newton(near, shortening, (1.0,)) or self._newton(near, shortening, _LENGTHS)
        if found is not None:
            return found
        limit = self._tolerance
        error = FemConvergenceError(
            "no static equilibrium",
            where="preload",
            value=f"relative residual {limit.history[-1]:.2e} after {limit.max_iterations} iterations",
            history=tuple(limit.history),
        )
        error.last_contact = self._last
        raise error

    def _newton(self, u: FloatArray, shortening: FloatArray, lengths: tuple[float, ...]) -> Point | None:
        limit = self._tolerance
        point = self._at(u, shortening)
        driven = bool(self.target.moved.any())
        last = float("inf")
        for iteration in range(limit.max_iterations):
            driving = driven and iteration == 0
            norm = point.size / limit.scale
            limit.history.append(norm)
            sizes = point.size, last, limit.scale
            if not driving and (norm <= limit.residual or is_rounding(self.model, point.u, self._slip, sizes)):
                return point
            last = point.size
            if not np.isfinite(norm):
                return None
            closing = self._must_close(point, iteration)
            # Moving supports and closing surfaces pass through states out of balance: no judging by the residual.
            tried = (1.0,) if driving or closing else lengths
            point = self._iterate(point, tried, driving=driving, closing=closing)
            self._last = point.contact
        return None

    def _at(self, u: FloatArray, shortening: FloatArray) -> Point:
        model, target = self.model, self.target
        force, state = internal_force(model, u, self._slip)
        if target.bolts is None:
            return Point(u, shortening, state, np.where(model.free, target.load - force, 0.0), np.empty(0))
        bolts = model.bolts
        residual = np.where(model.free, target.load - force - shortening @ bolts.pull, 0.0)
        miss = target.bolts - bolts.pull @ u - bolts.stiffness * shortening
        return Point(u, shortening, state, residual, miss)

    def _approached(self, u: FloatArray, shortening: FloatArray) -> FloatArray | None:
        """u (n_dof,) with loose parts moved as the load drives them until they touch; None where they meet nothing.

        For parts that drawing together leaves open, such as a pin in a hole: it has gaps all around and bears on one
        side.
        """
        contact, given = self.model.contact, u
        for _ in range(6 * len(self.model.bodies)):
            point = self._at(u, shortening)
            closed = point.contact.status[:, 0] > 0
            if loose_motion(self.model, closed) is None:
                break
            drift = loose_drift(self.model, closed, point.residual)
            rate = contact.relative(drift[:, None])[::3, 0]
            meets = np.flatnonzero((rate < -_TOUCH) & ~closed)
            if not len(meets):
                return None
            gap = contact.initial_gap + contact.relative(u[:, None])[::3, 0] + _TOUCH * contact.facet_size
            u = u + drift * (gap[meets] / -rate[meets]).min()
        return None if u is given else u

    def _must_close(self, point: Point, iteration: int) -> bool:
        """Whether to draw points together: at the first touch, or where open surfaces leave a body loose."""
        contact = self.model.contact
        closed = point.contact.status[:, 0] > 0
        if self.target.touching and iteration == 0:
            # Parts that are held with a gap between them may never meet: drawn together they would start far off.
            touch = contact.initial_gap + contact.relative(point.u[:, None])[::3, 0] <= _TOUCH * contact.facet_size
            return bool(touch.any()) or loose_motion(self.model, closed) is not None
        if all(closed[contact.pair == number].any() for number in range(len(contact.names))):
            return False
        share = loose_motion(self.model, closed)
        if share is None:
            return False
        self._closing += 1
        if self._closing > _CLOSING_STEPS:
            open_pairs = [name for n, name in enumerate(contact.names) if not closed[contact.pair == n].any()]
            advice = "check the direction of the loads, the initial gaps and that the surfaces meet"
            where = f"contact {', '.join(open_pairs)}"
            value = f"{loose_bodies(self.model, share)} free"
            raise _NeverClosesError("the interface never closes", where=where, value=value, advice=advice)
        return True

    def _iterate(self, point: Point, lengths: tuple[float, ...], *, driving: bool, closing: bool) -> Point:
        model, moved = self.model, self.target.moved
        residual = point.residual
        if closing:
            relative = model.contact.operator @ point.u
            drawn = self._drawn(relative) | (point.contact.status[:, 0] > 0)
            contact = model.contact.stick_tangent(drawn.astype(np.int64))
            bilateral = model.contact.bilateral_traction(relative, self._slip[:, :, 0])
            change = np.where(np.repeat(drawn, 3), bilateral - point.contact.traction[:, 0], 0.0)
            pull = model.contact.force(change[:, None])[:, 0]
            residual = np.where(model.free, residual - pull, 0.0)
        else:
            contact = model.contact.tangent(point.u, self._slip[:, :, 0])
        full = model.elastic_tangent(point.u) + contact
        right = np.where(model.free, residual - full @ moved, moved) if driving else residual
        du, dd = self._direction(point, full, right)
        best: Point | None = None
        for length in lengths:
            trial = self._at(point.u + length * du, point.shortening + length * dd)
            if best is None or trial.size < best.size:
                best = trial
            if trial.size < point.size:
                break
        assert best is not None
        if driving:
            self._rescale(best, full @ moved)
        return best

    def _drawn(self, relative: FloatArray) -> BoolArray:
        """Points (n_point,) to draw together: the nearest of every pair, all where those leave a body loose.

        Curved surfaces that touch in a point would be flattened by drawing all of them together.
        """
        near = self.model.contact.nearest(relative)
        return near if loose_motion(self.model, near) is None else np.ones_like(near)

    def _symmetric(self, point: Point, full: sp.csr_matrix) -> sp.csr_matrix:
        """The tangent without how the limit of friction follows the pressure."""
        contact = self.model.contact
        change = contact.tangent(point.u, self._slip[:, :, 0], symmetric=True)
        change = change - contact.tangent(point.u, self._slip[:, :, 0])
        return self.model.constrain(full + change)

    def _direction(self, point: Point, full: sp.csr_matrix, right: FloatArray) -> tuple[FloatArray, FloatArray]:
        tangent = self.model.constrain(full)
        if self.target.bolts is None and self.model.n_dof >= LARGE:
            du = self._large.solve(tangent, lambda: self._symmetric(point, full), right, np.empty(0))[0]
            return du, np.zeros(len(self.model.bolts.bolts))
        solver = make_solver(self._tolerance.solver, symmetric=False)
        solver.analyse(tangent)
        solver.factor(tangent)
        if self.target.bolts is None:
            return solver.solve(right), np.zeros(len(self.model.bolts.bolts))
        bolts = self.model.bolts
        pull = np.where(self.model.free, bolts.pull, 0.0)
        solution = solver.solve(np.column_stack([right, pull.T]))
        compliance = np.diag(bolts.stiffness) - bolts.pull @ solution[:, 1:]
        self._check_tightened(compliance, point.contact)
        dd = np.linalg.solve(compliance, point.bolt_residual - bolts.pull @ solution[:, 0])
        return np.asarray(solution[:, 0] - solution[:, 1:] @ dd), np.asarray(dd)

    def _check_tightened(self, response: FloatArray, contact: ContactState) -> None:
        """Refuse bolts whose force does not answer to their shortening, by d F / d delta (n_bolt, n_bolt) N/m."""
        bolts = self.model.bolts
        share = response / np.sqrt(np.outer(bolts.stiffness, bolts.stiffness))
        if np.linalg.svd(share, compute_uv=False).min() > _SLACK:
            return
        slack = [bolt.name for bolt, own in zip(bolts.bolts, np.abs(np.diag(share)), strict=True) if own <= _SLACK]
        names = ", ".join(slack or [bolt.name for bolt in bolts.bolts])
        if (contact.status == 0).any() and (contact.status > 0).any():
            # An iterate on the way whose contact has opened says nothing about the model: a smaller step may hold.
            raise FemConvergenceError("contact that a bolt presses opens on the way", where=f"bolt {names}")
        advice = "let both its ends press on parts, or hold its far end"
        raise FemInputError("nothing holds against tightening", where=f"bolt {names}", advice=advice)

    def _rescale(self, point: Point, forces: FloatArray) -> None:
        """Without loads the reactions measure the residual; a rigid motion has none and leaves what roundoff leaves."""
        limit, free = self._tolerance, self.model.free
        roundoff = _ROUNDOFF / limit.residual * float(np.linalg.norm(forces))
        reaction = float(np.linalg.norm(internal_force(self.model, point.u, self._slip)[0][~free]))
        limit.scale = max(limit.scale if self.target.load.any() else 0.0, reaction, roundoff)
