"""Factors of the iteration matrix that precondition the steps: one for all cases, and refreshed ones for slow cases.

The shared factor belongs to the preloaded, stuck state. A case whose steps need too many iterations gets a factor of
its own current tangent. Both turn with the mean rotation of every node since their state, see ``corotation``.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.corotation import NodalRotation, rotate
from fem.interface_equilibrium import LoosePoints, loose_points
from fem.linear_solver import LinearSolver, make_solver
from fem.modes import ModalBasis
from fem.motion import Pace
from fem.step_equation import StepEquation

KEPT = 6
"""Factors kept in memory, least recently used dropped first; a dropped one is computed again, to the same bits."""

_Key = tuple[int, bytes]
Solve = Callable[[FloatArray, IntArray], FloatArray]


@dataclass(frozen=True)
class _Rest:
    """Tangents of the bodies and stuck contact at the equilibrium, and the viscous tangent of Green-Lagrange bodies."""

    stiffness: sp.csr_matrix
    viscous: sp.csr_matrix


class Preconditioner:
    """Approximate inverses of the iteration matrices of all step sizes.

    Parameters
    ----------
    equations : the step equation of every level of halving.
    """

    def __init__(self, equations: Callable[[int], StepEquation], modes: ModalBasis, solver: str) -> None:
        self._equations, self._solver = equations, solver
        dynamics = equations(0).dynamics
        self._dynamics, model = dynamics, dynamics.model
        contact = model.contact.stick_tangent(dynamics.equilibrium.contact.status[:, 0])
        viscous = dynamics.beta * (modes.material - model.stiffness)
        self._rest = _Rest(modes.stiffness + contact, viscous)
        self._rotation = NodalRotation(model)
        self._factors: dict[_Key, LinearSolver] = {}
        self._loose: LoosePoints | None = None
        self.built = 0

    def rest(self, level: int) -> LinearSolver:
        """The factor at the equilibrium for steps of this level."""
        return self._factor(
            (level, b""), lambda: self._equations(level).matrix(self._rest.stiffness, self._rest.viscous)
        )

    def loose(self, index: IntArray) -> LoosePoints | None:
        """The contact points ``index`` on the shared factor for whole output intervals; None for none."""
        if not len(index):
            return None
        if self._loose is None or not np.array_equal(self._loose.index, index):
            equation, dynamics = self._equations(0), self._dynamics
            factor, mask, s = self.rest(0), dynamics.mask, equation.scheme
            share = (1.0 - s.alpha_f) * equation.step**2 * s.beta
            closed = dynamics.equilibrium.contact.status[:, 0] > 0
            contact = dynamics.model.contact
            known = self._loose
            self._loose = loose_points(contact, closed, index, lambda f: share * mask * factor.solve(mask * f), known)
        return self._loose

    def prepare(self, level: int, pace: Pace, u: FloatArray) -> Solve:
        """(r, live) -> A^-1 r for r (n_dof, n_live) of the cases (n_live,), for a step to about u (n_dof, n_case)."""
        n_case = u.shape[1]
        start = np.repeat(self._dynamics.equilibrium.u[:, None], n_case, axis=1)
        start[:, pace.anchored] = pace.anchor_u
        groups = [(np.array([case]), self._anchored(level, pace, number)) for number, case in enumerate(pace.anchored)]
        common = np.setdiff1d(np.arange(n_case), pace.anchored)
        if len(common):
            groups.append((common, self.rest(level)))
        w = self._rotation(u - start)

        def solve(residual: FloatArray, live: IntArray) -> FloatArray:
            if len(groups) == 1:
                turn = w if len(live) == n_case else np.ascontiguousarray(w[:, live])
                return _turned(groups[0][1], turn, residual)
            result = np.empty_like(residual)
            for cases, solver in groups:
                columns = np.flatnonzero(np.isin(live, cases))
                if len(columns):
                    turn = np.ascontiguousarray(w[:, live[columns]])
                    result[:, columns] = _turned(solver, turn, np.ascontiguousarray(residual[:, columns]))
            return result

        return solve

    def _anchored(self, level: int, pace: Pace, number: int) -> LinearSolver:
        u, slip = np.ascontiguousarray(pace.anchor_u[:, number]), pace.anchor_slip[:, :, number]
        key = hashlib.blake2b(u.tobytes(), digest_size=16).digest()
        return self._factor((level, key), lambda: self._current(level, u, np.ascontiguousarray(slip)))

    def _current(self, level: int, u: FloatArray, slip: FloatArray) -> sp.csr_matrix:
        """Iteration matrix at u with the symmetric part of the contact tangent that is positive semidefinite."""
        model, dynamics = self._dynamics.model, self._dynamics
        stiffness = model.elastic_tangent(u) + model.contact.tangent(u, slip, symmetric=True)
        viscous = dynamics.beta * (model.elastic_tangent(u, geometric=False) - model.stiffness)
        return self._equations(level).matrix(stiffness, viscous)

    def _factor(self, key: _Key, matrix: Callable[[], sp.csr_matrix]) -> LinearSolver:
        solver = self._factors.pop(key, None)
        if solver is None:
            solver = make_solver(self._solver, symmetric=True, single=True)
            assembled = matrix()
            solver.analyse(assembled)
            solver.factor(assembled)
            self.built += 1
            while len(self._factors) >= KEPT:
                self._factors.pop(next(iter(self._factors)))
        self._factors[key] = solver
        return solver


def _turned(solver: LinearSolver, w: FloatArray, residual: FloatArray) -> FloatArray:
    """R A^-1 R' r with the rotation vectors w (n_dof, n_case) of the nodes."""
    back = rotate(w, -1.0, residual)
    return rotate(w, 1.0, solver.solve(back).reshape(back.shape))
