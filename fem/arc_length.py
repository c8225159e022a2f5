"""Static equilibrium paths through limit points: arc-length continuation in displacement and load factor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem.arrays import FloatArray
from fem.contact import ContactState
from fem.errors import FemConvergenceError
from fem.linear_solver import make_solver
from fem.model import Model
from fem.modes import rest_state
from fem.newton import internal_force
from fem.path_settings import PathSettings
from fem.preload import StaticState, nodal_load
from fem.rigid_motion import check_closed, check_restraint
from fem.roundoff import is_rounding

_GROW, _SHRINK = 1.5, 0.5
_EASY, _HARD = 4, 7
"""A step that needed fewer iterations than _EASY lets the next one grow, more than _HARD makes it shrink."""

_DRIFT, _TURN = 0.5, 0.7
"""Largest distance of a point from its prediction over the length of the step, smallest cosine between tangents."""

_SHORT = 1e-3
"""Arc length up to which a step may turn as it likes: a kink, such as closing contact, turns any step."""


@dataclass(frozen=True)
class EquilibriumPath:
    """Equilibria f_int(u) + f_contact(u) = p_0 + lambda p along a path.

    Attributes
    ----------
    load_factors : (n_point,) lambda; displacements : (n_point, n_dof) m.
    rates : (n_point,) d lambda/ds along the arc; it changes sign at a limit point.
    limit_points : (n_limit,) indices of the points that are limit points, located to ``tolerance``.
    states : the equilibria with their contact history.
    """

    load_factors: FloatArray
    displacements: FloatArray
    rates: FloatArray
    limit_points: tuple[int, ...]
    states: tuple[StaticState, ...]


@dataclass(frozen=True)
class _Point:
    """A converged point and the unit tangent (du, dlambda) there."""

    u: FloatArray
    factor: float
    contact: ContactState
    du: FloatArray
    dfactor: float


def follow_path(
    model: Model,
    load: FloatArray,
    settings: PathSettings | None = None,
    *,
    start: StaticState | None = None,
    stop: Callable[[FloatArray, float], bool] | None = None,
) -> EquilibriumPath:
    """Follow the equilibria f(u) = p_0 + lambda p from lambda = 0 through limit points, snap-through and snap-back.

    Predictor along the tangent, corrector by Newton on the plane through the prediction across the tangent, bordered
    elimination with one factor per iteration, step length by the number of iterations. Limit points are located by the
    secant method on d lambda/ds and belong to the path.

    Parameters
    ----------
    load : p, (n_dof,) N; supports stay where ``start`` has them. Follower pressures of the model grow with lambda, on
        top of those that ``start`` carries.
    start : equilibrium at load factor 0; what it carries, such as a preload, stays as p_0. None: the undeformed state.
    stop : from u (n_dof,) and lambda; the path ends at the first point where it is True. None: where lambda first
        reaches 1, at exactly 1.

    Raises
    ------
    FemConvergenceError : no step of the smallest length converges, or ``max_steps`` without ``stop``; the points so far
        are in ``last_good`` of the error, an ``EquilibriumPath``.

    Source: Riks, Int. J. Solids Struct. 15 (1979) 529-551.
    """
    check_restraint(model)
    load = nodal_load(model, load)
    settings = settings or PathSettings()
    finished = stop if stop is not None else (lambda _, factor: factor >= 1.0)
    state = start if start is not None else rest_state(model)
    state.check_belongs(model)
    check_closed(model, state.contact.status[:, 0], "path")
    path = _Path(model, load, settings, state)
    here = path.first(state)
    points, limits, length = [here], [], settings.step
    for _ in range(settings.max_steps):
        here = path.measured(here)
        there, iterations, length = path.advance(here, length, points)
        if here.dfactor * there.dfactor < 0.0:
            limit = path.limit_between(here, there)
            limits.append(len(points))
            points.append(limit)
        if stop is None and there.factor > 1.0:
            there = path.at_full_load(here, there)
        points.append(there)
        here = there
        if finished(here.u, here.factor):
            return _record(points, limits, path.at)
        if iterations < _EASY:
            length = min(_GROW * length, settings.largest_step)
        elif iterations > _HARD:
            length *= _SHRINK
    error = FemConvergenceError(
        "the path did not reach its end",
        where="arc length",
        value=f"load factor {here.factor:.6g} after {settings.max_steps} steps",
        advice="allow more or larger steps, or stop earlier",
    )
    error.last_good = _record(points, limits, path.at)
    raise error


def _record(points: list[_Point], limits: list[int], at: Callable[[float], Model]) -> EquilibriumPath:
    return EquilibriumPath(
        np.array([p.factor for p in points]),
        np.array([p.u for p in points]),
        np.array([p.dfactor for p in points]),
        tuple(limits),
        tuple(StaticState(p.u, p.contact, (p.factor,), (), None, at(p.factor).followers.factor) for p in points),
    )


class _Path:
    """The equations of one path and their linear algebra; ``scale`` is u_s, by which displacements are measured."""

    def __init__(self, model: Model, load: FloatArray, settings: PathSettings, start: StaticState) -> None:
        self._model, self._settings, self._start = model, settings, start
        self._load = np.where(model.free, load, 0.0)
        self._size = float(np.linalg.norm(self._pushed(start.u, self._load)))
        if not (np.isfinite(self._size) and self._size > 0.0):
            raise FemConvergenceError("the load has no finite, positive size", where="arc length", value=self._size)
        self._scale = 1.0
        self._linear = 1.0
        self._dead = internal_force(self.at(0.0), start.u, start.contact.slip)[0]

    def first(self, state: StaticState) -> _Point:
        """The start with its tangent towards a growing load; sets the length scale of the path."""
        answer = self._solve(state.u, 0.0, state.contact.slip, [self._pushed(state.u, self._load)])[0]
        self._scale = self._linear = float(np.linalg.norm(answer))
        return _Point(state.u, 0.0, state.contact, *self._unit(answer, 1.0))

    def measured(self, here: _Point) -> _Point:
        """The point with its tangent of unit length by the u_s that holds from there on."""
        self._scale = max(self._linear, float(np.linalg.norm(here.u - self._start.u)))
        du, dfactor = self._unit(here.du, here.dfactor)
        return replace(here, du=du, dfactor=dfactor)

    def advance(self, here: _Point, length: float, points: list[_Point]) -> tuple[_Point, int, float]:
        """The next point, its iterations and the step length that led there, halved until the corrector converges."""
        while length >= self._settings.smallest_step:
            found = self.step(here, length)
            if found is not None and (length <= _SHORT or not self._strays(here, found[0], length)):
                return *found, length
            length *= _SHRINK
        error = FemConvergenceError(
            "no step along the path converges",
            where="arc length",
            value=f"load factor {here.factor:.6g}",
            advice="check for a bifurcation or for loose parts here",
        )
        error.last_good = _record(points, [], self.at)
        raise error

    def _strays(self, here: _Point, there: _Point, length: float) -> bool:
        """Whether a step may have led to another path: far from its prediction for its length, or another way."""
        du, dfactor = there.u - here.u - length * here.du, there.factor - here.factor - length * here.dfactor
        drift = self._dot(du, dfactor, du, dfactor)
        turn = self._dot(here.du, here.dfactor, there.du, there.dfactor)
        return drift > (_DRIFT * length) ** 2 or turn < _TURN

    def step(self, here: _Point, length: float) -> tuple[_Point, int] | None:
        """One step of given arc length; None where the corrector does not converge."""
        model, slip = self._model, here.contact.slip
        u, factor = here.u + length * here.du, here.factor + length * here.dfactor
        last = float("inf")
        for iteration in range(self._settings.max_iterations):
            force, contact = internal_force(self.at(factor), u, slip)
            residual = np.where(model.free, self._dead + factor * self._load - force, 0.0)
            size = float(np.linalg.norm(residual))
            if not np.isfinite(size):
                return None
            to_residual, to_load = self._solve(u, factor, slip, [residual, self._pushed(u, self._load)])
            if iteration > 0 and self._is_balanced(size, last, u, slip):
                du, dfactor = self._unit(to_load, 1.0)
                sign = 1.0 if self._dot(du, dfactor, here.du, here.dfactor) >= 0.0 else -1.0
                return _Point(u, factor, contact, sign * du, sign * dfactor), iteration
            last = size
            # Stay on the plane across the tangent: du . du_0 / u_1^2 + dlambda dlambda_0 = 0.
            across = here.du @ to_load / self._scale**2 + here.dfactor
            change = -float(here.du @ to_residual / self._scale**2 / across)
            u, factor = u + to_residual + change * to_load, factor + change
        return None

    def at_full_load(self, here: _Point, there: _Point) -> _Point:
        """The point with lambda = 1 between two others, by Newton at that load."""
        share = (1.0 - here.factor) / (there.factor - here.factor)
        model, slip = self._model, here.contact.slip
        u, last = here.u + share * (there.u - here.u), float("inf")
        for _ in range(self._settings.max_iterations):
            force, contact = internal_force(self.at(1.0), u, slip)
            residual = np.where(model.free, self._dead + self._load - force, 0.0)
            to_residual, to_load = self._solve(u, 1.0, slip, [residual, self._pushed(u, self._load)])
            size = float(np.linalg.norm(residual))
            if self._is_balanced(size, last, u, slip):
                return _Point(u, 1.0, contact, *self._unit(to_load, 1.0))
            u, last = u + to_residual, size
        raise FemConvergenceError(
            "no equilibrium at the full load", where="arc length", value=f"after {here.factor:.6g}"
        )

    def limit_between(self, here: _Point, there: _Point) -> _Point:
        """The point between two others where d lambda/ds = 0, by the safeguarded secant method on the arc length."""
        low = 0.0
        high = self._dot(there.u - here.u, there.factor - here.factor, here.du, here.dfactor)
        rate_low, rate_high = float(here.dfactor), float(there.dfactor)
        best = there if abs(there.dfactor) < abs(here.dfactor) else here
        for _ in range(60):
            margin = 0.01 * (high - low)
            secant = low - rate_low * (high - low) / (rate_high - rate_low)
            length = min(max(secant, low + margin), high - margin)
            found = self.step(here, length)
            if found is None:
                break
            point = found[0]
            if abs(point.dfactor) < abs(best.dfactor):
                best = point
            if abs(point.dfactor) < np.sqrt(self._settings.tolerance):
                # The load is stationary here: its error is the square of that of the place.
                break
            if point.dfactor * rate_low > 0.0:
                low, rate_low = length, point.dfactor
            else:
                high, rate_high = length, point.dfactor
        return best

    def _is_balanced(self, size: float, last: float, u: FloatArray, slip: FloatArray) -> bool:
        """Whether a residual of ``size`` N, after ``last``, is within the tolerance or all that rounding leaves."""
        sizes = size, last, self._size
        return size <= self._settings.tolerance * self._size or is_rounding(self._model, u, slip, sizes)

    def at(self, factor: float) -> Model:
        """The model with the follower pressures of a load factor."""
        return self._model.following(self._start.follower + factor * self._model.followers.factor)

    def _pushed(self, u: FloatArray, load: FloatArray) -> FloatArray:
        """Derivative of the load by lambda at u, (n_dof,) N: the dead one and that of the follower pressures."""
        if not self._model.followers.any:
            return load
        return np.where(self._model.free, load + self._model.followers.force(u[:, None])[:, 0], 0.0)

    def _solve(self, u: FloatArray, factor: float, slip: FloatArray, right: list[FloatArray]) -> list[FloatArray]:
        """Tangent answers to several loads at a load factor."""
        model = self.at(factor)
        tangent = model.constrain(model.elastic_tangent(u) + model.contact.tangent(u, slip[:, :, 0]))
        solver = make_solver(self._settings.solver, symmetric=False)
        solver.analyse(tangent)
        solver.factor(tangent)
        return list(solver.solve(np.column_stack(right)).T)

    def _unit(self, du: FloatArray, dfactor: float) -> tuple[FloatArray, float]:
        length = float(np.sqrt(self._dot(du, dfactor, du, dfactor)))
        return du / length, dfactor / length

    def _dot(self, du: FloatArray, dfactor: float, other: FloatArray, other_factor: float) -> float:
        return float(du @ other / self._scale**2 + dfactor * other_factor)
