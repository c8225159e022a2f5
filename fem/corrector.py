"""Two ways to solve the equation of a step: Anderson acceleration on a frozen factor, and full Newton.

The first is the fast one; its factor never enters the answer. The second, with the consistent unsymmetric tangent
factored in every iteration, is the reference that the first is tested against.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from fem.anderson import Anderson
from fem.arrays import BoolArray, FloatArray, IntArray
from fem.contact import ContactState
from fem.errors import FemConvergenceError
from fem.interface_equilibrium import LoosePoints
from fem.linear_solver import make_solver
from fem.motion import SolvedStep
from fem.step_equation import StepEquation, StepProblem, Trial
from fem.viscous_tangent import viscous_stiffness

DIVERGED = 1e12
"""Residual over the peak inertia force beyond which iterating on is pointless and overflows single precision."""

_Pair = tuple[FloatArray, FloatArray]
_NONE: IntArray = np.array([], dtype=np.int64)

ADVICE = "use a smaller time step, a smaller amplitude, or a start that has settled (snap-back)"


class Corrector:
    """Solves steps to a residual of ``tolerance`` times ``scale`` N in at most ``max_iterations``.

    Without a scale it is the largest inertia force or load of the case so far, this step included. While a loaded
    structure rests there is neither: a residual of ``rounding`` N is balance then.
    """

    def __init__(self, tolerance: float, scale: float | None, max_iterations: int, rounding: float = 0.0) -> None:
        self.tolerance, self.scale, self.max_iterations = tolerance, scale, max_iterations
        self._least = rounding / tolerance

    def size(self, trial: Trial, problem: StepProblem) -> FloatArray:
        """Norms of the residuals relative to the scale, (n_case,)."""
        residual = np.sqrt(np.einsum("nc,nc->c", trial.residual, trial.residual))
        if self.scale is not None:
            return np.asarray(residual / self.scale)
        scale = np.maximum(problem.force, np.sqrt(np.einsum("nc,nc->c", trial.inertia_a, trial.inertia_a)))
        scale = np.maximum(scale, self._least)
        # A case at rest on which nothing acts has neither residual nor scale.
        return np.asarray(residual / np.where(scale > 0.0, scale, 1.0))

    def failure(self, problem: StepProblem, history: list[float]) -> FemConvergenceError:
        """The error of a step that was given up after these residuals."""
        return FemConvergenceError(
            "time step does not converge",
            where=f"step {problem.number}",
            value=f"relative residual {history[-1]:.2e}",
            advice=ADVICE,
            history=tuple(history),
        )

    def accelerated(
        self,
        equation: StepEquation,
        problem: StepProblem,
        solve: Callable[[FloatArray, IntArray], FloatArray],
        anderson: Anderson,
        loose: LoosePoints | None = None,
        anchored: IntArray = _NONE,
    ) -> SolvedStep:
        """Anderson-accelerated iteration on all cases together; each leaves when it has converged.

        ``solve`` preconditions residuals (n_dof, n_live) of the cases (n_live,). The remainders of the ``loose`` points
        are unknowns beside the acceleration: mixed with the same weights, they stay those that it was made with. Cases
        that are ``anchored`` have factors of their own, to which the compliance of the points does not belong.
        """
        a, live = problem.guess, np.arange(problem.guess.shape[1])
        phi = _remainder(equation, problem, loose, a)
        mixing = _Mixing(anderson, len(phi))
        history: list[float] = []
        found: list[tuple[IntArray, SolvedStep]] = []
        for iteration in range(self.max_iterations):
            trial = equation.evaluate(a, problem)
            size = self.size(trial, problem)
            history.append(float(size.max()))
            active = ~(size <= self.tolerance)
            if not active.all():
                solved = _solved(a, trial, np.full(len(live), iteration))
                found.append((live[~active], solved if not active.any() else _chosen(solved, np.flatnonzero(~active))))
                if not active.any():
                    return _joined(found)
            if not history[-1] < DIVERGED:
                break
            residual = trial.residual
            if not active.all():
                kept = np.flatnonzero(active)
                problem, live = problem.cases(kept), live[kept]
                a, residual, phi = _columns((a, residual, phi), kept)
                mixing.keep(kept)
            if loose is None or iteration == 0:
                aim = phi
            else:
                aim, force = _settled(equation, problem, loose, (a, phi), np.isin(live, anchored))
                residual = residual + force
            correction = -solve(residual, live) * equation.dynamics.mask
            # The first correction of loose points only tells what remainders the second one starts from.
            if loose is None or iteration > 0:
                correction, moved = mixing.step(live, (correction, aim - phi))
                phi = phi + moved
            a = a + correction
        raise self.failure(problem, history)

    def newton(self, equation: StepEquation, problem: StepProblem, solver: str) -> SolvedStep:
        """Full Newton with the consistent tangent, one case after the other."""
        n_case = problem.guess.shape[1]
        cases = [np.array([c]) for c in range(n_case)]
        return _joined([(case, self._newton(equation, problem.cases(case), solver)) for case in cases])

    def _newton(self, equation: StepEquation, problem: StepProblem, solver: str) -> SolvedStep:
        a = problem.guess
        history: list[float] = []
        for iteration in range(self.max_iterations):
            trial = equation.evaluate(a, problem)
            history.append(float(self.size(trial, problem)[0]))
            if history[-1] <= self.tolerance:
                return _solved(a, trial, np.array([iteration]))
            if not history[-1] < DIVERGED:
                break
            a = a - _newton_step(equation, problem, a, trial, solver) * equation.dynamics.mask
        raise self.failure(problem, history)


class _Mixing:
    """Anderson's steps from the corrections of one time step, each in two parts: accelerations and remainders."""

    def __init__(self, anderson: Anderson, n_carried: int) -> None:
        anderson.forget(n_carried)
        self._anderson = anderson
        self._last: tuple[_Pair, _Pair] | None = None

    def step(self, live: IntArray, change: _Pair) -> _Pair:
        """The step of the cases (n_live,) from their correction."""
        if self._last is not None:
            step, before = self._last
            self._anderson.remember(live, step[0], change[0] - before[0], (step[1], change[1] - before[1]))
        mixed = self._anderson.step(live, change[0]), self._anderson.carried_step(live, change[1])
        self._last = mixed, change
        return mixed

    def keep(self, kept: IntArray) -> None:
        """Go on with the columns ``kept`` alone."""
        if self._last is not None:
            (step, moved), (change, aim) = self._last
            step, moved, change, aim = _columns((step, moved, change, aim), kept)
            self._last = (step, moved), (change, aim)


def _columns(arrays: Iterable[FloatArray], kept: IntArray) -> Iterator[FloatArray]:
    return (np.ascontiguousarray(x[:, kept]) for x in arrays)


def _relative(
    equation: StepEquation, problem: StepProblem, loose: LoosePoints, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Relative displacements (3 n, n_case) m of the loose points at a, and their slip history (n, 2, n_case) m."""
    v = loose.gap(problem.u0) + equation.step**2 * equation.scheme.beta * loose.gap(a)
    return v, np.ascontiguousarray(problem.slip[loose.index])


def _remainder(equation: StepEquation, problem: StepProblem, loose: LoosePoints | None, a: FloatArray) -> FloatArray:
    """Remainder (3 n, n_case) Pa of the loose points at a; no rows without such points."""
    return np.empty((0, a.shape[1])) if loose is None else loose.remainder(*_relative(equation, problem, loose, a))


def _settled(
    equation: StepEquation, problem: StepProblem, loose: LoosePoints, now: _Pair, as_it_is: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Remainder at the equilibrium of the loose points, and what it adds to the residual (n_dof, n_case) N.

    now : acceleration and remainder; as_it_is : (n_case,) cases that keep the remainder of their acceleration.
    """
    a, phi = now
    v, slip = _relative(equation, problem, loose, a)
    own = loose.remainder(v, slip)
    aim = np.where(as_it_is, own, loose.settled(v, phi, slip))
    return aim, (1.0 - equation.scheme.alpha_f) * loose.force(aim - own) * equation.dynamics.mask


def _newton_step(equation: StepEquation, problem: StepProblem, a: FloatArray, trial: Trial, solver: str) -> FloatArray:
    """J^-1 r with J the consistent tangent, the low-rank inertia by the formula of Woodbury."""
    direct = make_solver(solver, symmetric=False)
    matrix = consistent_matrix(equation, problem, a)
    direct.analyse(matrix)
    direct.factor(matrix)
    left, ratio = equation.correction
    left = left * equation.dynamics.mask
    if not left.shape[1]:
        return direct.solve(trial.residual)
    solution = direct.solve(np.column_stack([trial.residual, left]))
    plain, spread = solution[:, :1], solution[:, 1:]
    weight = (1.0 - equation.scheme.alpha_m) * ratio[:, None]
    small = np.eye(left.shape[1]) + weight * (left.T @ spread)
    return np.asarray(plain - spread @ np.linalg.solve(small, weight * (left.T @ plain)))


def consistent_matrix(equation: StepEquation, problem: StepProblem, a: FloatArray) -> sp.csr_matrix:
    """d r / d a at a (n_dof, 1) without the low-rank inertia; unsymmetric where points slip."""
    h, s, dynamics = equation.step, equation.scheme, equation.dynamics
    model = dynamics.model
    u = np.ascontiguousarray((problem.u0 + h * h * s.beta * a)[:, 0])
    v = np.ascontiguousarray((problem.v0 + h * s.gamma * a)[:, 0])
    stiffness = model.elastic_tangent(u) + model.contact.tangent(u, problem.slip[:, :, 0])
    stiffness = stiffness + viscous_stiffness(model, u, v, dynamics.beta)
    viscous = dynamics.beta * (model.elastic_tangent(u, geometric=False) - model.stiffness)
    return equation.matrix(stiffness.tocsr(), viscous.tocsr())


def _solved(a: FloatArray, trial: Trial, iterations: IntArray) -> SolvedStep:
    forces = (trial.inertia_a, trial.damping_a, trial.force, trial.viscous)
    return SolvedStep(a, *forces, trial.strain, trial.contact, iterations)


def _chosen(solved: SolvedStep, columns: IntArray) -> SolvedStep:
    """Some of the cases."""
    return _rearranged([solved], columns)


def _joined(parts: list[tuple[IntArray, SolvedStep]]) -> SolvedStep:
    """The cases side by side in their order, from groups of cases that were solved together."""
    if len(parts) == 1:
        return parts[0][1]
    return _rearranged([solved for _, solved in parts], np.argsort(np.concatenate([cases for cases, _ in parts])))


def _rearranged(parts: list[SolvedStep], columns: IntArray) -> SolvedStep:
    """Columns of the parts side by side."""

    def pick(arrays: Iterable[npt.NDArray[Any]]) -> npt.NDArray[Any]:
        return np.ascontiguousarray(np.concatenate(list(arrays), axis=-1)[..., columns])

    contact = ContactState(
        traction=pick(part.contact.traction for part in parts),
        slip=pick(part.contact.slip for part in parts),
        status=pick(part.contact.status for part in parts),
    )
    names = (field.name for field in fields(SolvedStep) if field.name != "contact")
    return SolvedStep(contact=contact, **{name: pick(getattr(part, name) for part in parts) for name in names})
