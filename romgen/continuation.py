"""Pseudo-arclength continuation of F(x, p) = 0 with stability and located special points.

Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", 1977; test functions after Kuznetsov,
"Elements of Applied Bifurcation Theory", ch. 10.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import brentq

from romgen.arrays import ComplexArray, FloatArray
from romgen.branch import Branch, ContinuationSettings, End, Kind, ParameterSystem, SpecialPoint
from romgen.errors import NumericalError


@dataclass(frozen=True)
class _Point:
    """A point in scaled variables v = (x / state_scale, p / parameter_scale) with its unit tangent."""

    v: FloatArray
    tangent: FloatArray
    multipliers: ComplexArray
    orientation: float
    step: float
    kind: Kind | None = None


class _Curve:
    """F in scaled variables: corrector, tangent and test functions."""

    def __init__(self, system: ParameterSystem, settings: ContinuationSettings, n_state: int) -> None:
        self.system, self.settings = system, settings
        self.scale = np.append(np.full(n_state, settings.state_scale), settings.parameter_scale)

    def linearise(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return F (n,) and its derivative (n, n + 1) by v."""
        u = v * self.scale
        F, F_x, F_p = self.system.linearise(u[:-1], float(u[-1]))
        return F, np.column_stack([F_x, F_p]) * self.scale

    def correct(self, guess: FloatArray, normal: FloatArray) -> tuple[FloatArray, tuple[float, ...]]:
        """Return the solution on the plane normal . (v - guess) = 0 and the Newton updates that led to it."""
        v, updates = guess.copy(), []
        for _ in range(self.settings.iterations):
            F, DF = self.linearise(v)
            try:
                update = np.linalg.solve(np.vstack([DF, normal]), -np.append(F, normal @ (v - guess)))
            except np.linalg.LinAlgError:
                break
            v = v + update
            updates.append(float(np.max(np.abs(update))))
            if not np.isfinite(updates[-1]) or updates[-1] > 1e6:
                break
            if updates[-1] < self.settings.tolerance * (1.0 + np.max(np.abs(v))):
                return v, tuple(updates)
        raise NumericalError(
            "Newton iteration did not converge",
            where="continuation",
            value=f"last update {updates[-1] if updates else float('nan'):.2e}",
            advice="start nearer to a solution or take a smaller step",
            history=tuple(updates),
        )

    def point(self, v: FloatArray, along: FloatArray, step: float, kind: Kind | None = None) -> _Point:
        """Return the solution v as a point whose tangent has a positive product with ``along``."""
        _, DF = self.linearise(v)
        bordered = np.vstack([DF, along])
        # lstsq: at an exact branch point the bordered matrix is singular and any null vector will do
        tangent = np.linalg.lstsq(bordered, np.append(np.zeros(DF.shape[0]), 1.0), rcond=None)[0]
        tangent /= np.linalg.norm(tangent)
        u = v * self.scale
        multipliers = self.system.multipliers(u[:-1], float(u[-1]))
        orientation = float(np.linalg.slogdet(np.vstack([DF, tangent]))[0])
        return _Point(v, tangent, multipliers, orientation, step, kind)

    def advance(self, start: _Point, h: float, kind: Kind | None = None) -> tuple[_Point, int]:
        """Return the point one arclength step h further, and the Newton iterations it took."""
        v, updates = self.correct(start.v + h * start.tangent, start.tangent)
        return self.point(v, start.tangent, abs(h), kind), len(updates)


def continue_branch(system: ParameterSystem, x0: FloatArray, p0: float, settings: ContinuationSettings) -> Branch:
    """Follow the branch of F(x, p) = 0 through (x0, p0) in both directions.

    Parameters
    ----------
    x0 : (n_state,) guess of a solution at the fixed parameter p0.

    Raises
    ------
    NumericalError : no solution was found from (x0, p0) at fixed p0; carries the Newton updates.

    Source: Keller 1977.
    """
    curve = _Curve(system, settings, x0.size)
    parameter_axis = np.append(np.zeros(x0.size), 1.0)
    v, _ = curve.correct(np.append(x0, p0) / curve.scale, parameter_axis)
    start = curve.point(v, parameter_axis, 0.0)
    forward, end = _follow(curve, start)
    if end == "closed":
        return _branch(curve, [start, *forward], ("closed", "closed"))
    backward, begin = _follow(curve, curve.point(v, -start.tangent, 0.0))
    return _branch(curve, [*backward[::-1], start, *forward], (begin, end))


def solve_at(system: ParameterSystem, x0: FloatArray, p: float, settings: ContinuationSettings) -> FloatArray:
    """Return the solution x of F(x, p) = 0 that Newton's method reaches from x0 at fixed p.

    Raises
    ------
    NumericalError : no convergence; carries the Newton updates.
    """
    curve = _Curve(system, settings, x0.size)
    v, _ = curve.correct(np.append(x0, p) / curve.scale, np.append(np.zeros(x0.size), 1.0))
    return np.asarray(v[:-1] * settings.state_scale, dtype=np.float64)


def switch_branch(
    system: ParameterSystem, x: FloatArray, p: float, settings: ContinuationSettings, distance: float = 0.05
) -> tuple[FloatArray, float]:
    """Return a solution (x, p) on the other branch through a simple branch point.

    It lies on the plane phi . (x - x_b) = distance (in state scales) with F_x phi = 0.

    Parameters
    ----------
    x, p : the located branch point.

    Raises
    ------
    NumericalError : the corrector found no solution on that plane.

    Source: Keller 1977, ch. 5 (perpendicular to the null vector).
    """
    curve = _Curve(system, settings, x.size)
    _, F_x, _ = system.linearise(x, p)
    null = np.linalg.svd(F_x)[2][-1]
    normal = np.append(null, 0.0)
    v, _ = curve.correct(np.append(x, p) / curve.scale + distance * normal, normal)
    u = v * curve.scale
    return np.asarray(u[:-1], dtype=np.float64), float(u[-1])


def _follow(curve: _Curve, start: _Point) -> tuple[list[_Point], End]:
    """March from ``start`` along its tangent until something ends the branch."""
    s = curve.settings
    points: list[_Point] = []
    h, here, farthest = s.first_step, start, 0.0
    while len(points) < s.points:
        if h < s.smallest_step:
            return points, "stalled"
        trial, factor = _trial(curve, here, h)
        if trial is None:
            h *= factor
            continue
        farthest = max(farthest, float(np.linalg.norm(trial.v - start.v)))
        try:
            piece, end = _piece(curve, (start, here, trial), farthest)
        except NumericalError:  # a special point or the bound could not be located within this step: take a shorter one
            h *= 0.5
            continue
        points += piece
        if end is not None:
            return points, end
        here, h = trial, min(h * factor, s.largest_step)
    return points, "points"


def _piece(curve: _Curve, along: tuple[_Point, _Point, _Point], farthest: float) -> tuple[list[_Point], End | None]:
    """Return the points that the step from ``here`` to ``trial`` adds, and why the branch ends there, if it does."""
    start, here, trial = along
    s = curve.settings
    if np.linalg.norm(trial.v - start.v) < trial.step < 0.3 * farthest and trial.tangent @ start.tangent > 0.5:
        return [*_located(curve, here, trial), start], "closed"
    p, (lower, upper) = float(trial.v[-1] * curve.scale[-1]), s.parameter_range
    if not lower <= p <= upper:
        return _to_bound(curve, here, trial, lower if p < lower else upper), "range"
    beyond = np.max(np.abs(trial.v[:-1])) * s.state_scale > s.state_limit
    return [*_located(curve, here, trial), trial], "limit" if beyond else None


def _trial(curve: _Curve, here: _Point, h: float) -> tuple[_Point | None, float]:
    """Try one step; return the point, or None where it must be cut, and the factor of the next step."""
    s = curve.settings
    try:
        trial, iterations = curve.advance(here, h)
    except NumericalError:
        return None, 0.5
    angle = float(np.arccos(np.clip(here.tangent @ trial.tangent, -1.0, 1.0)))
    # a corrector that moves as far as the step, or a sharp turn, may have jumped to another branch
    jump = float(np.linalg.norm(trial.v - here.v - h * here.tangent))
    if angle > s.turn or jump > 0.5 * h:
        return None, 0.5
    return trial, float(np.clip(0.7 * s.turn / max(angle, 1e-12), 0.6, 1.0 if iterations > 5 else 1.6))


def _to_bound(curve: _Curve, here: _Point, trial: _Point, bound: float) -> list[_Point]:
    """Return the end of the branch on the parameter bound that the step crossed, after the special points before it."""
    target = bound / curve.scale[-1]
    share = float(np.clip((target - here.v[-1]) / (trial.v[-1] - here.v[-1]), 0.0, 1.0))
    if share * trial.step < curve.settings.smallest_step:
        return []
    guess = here.v + share * (trial.v - here.v)
    guess[-1] = target
    v, _ = curve.correct(guess, np.append(np.zeros(guess.size - 1), 1.0))
    end = curve.point(v, here.tangent, share * trial.step)
    return [*_located(curve, here, end), end]


def _tests(point: _Point) -> dict[Kind, float]:
    """Return the test functions whose sign changes mark special points.

    Fold: parameter component of the tangent; torus: prod_{i<j} (mu_i mu_j - 1); period doubling: prod (mu_i + 1);
    branch point: orientation of the bordered Jacobian.
    """
    mu = point.multipliers
    pairs = np.array([a * b - 1.0 for a, b in combinations(mu, 2)], dtype=np.complex128)
    return {
        "fold": float(point.tangent[-1]),
        "torus": float(np.prod(pairs / (1.0 + np.abs(pairs))).real),
        "period_doubling": float(np.prod((mu + 1.0) / (1.0 + np.abs(mu))).real),
        "branch_point": point.orientation,
    }


def _located(curve: _Curve, here: _Point, there: _Point) -> list[_Point]:
    """Return the special points between two neighbours, in branch order, located by root finding in arclength."""
    length = float(here.tangent @ (there.v - here.v))
    before, after = _tests(here), _tests(there)
    # the boundary of the range is no step along the tangent, but its projection is a valid bracket
    roots = [(_root(curve, here, kind, length), kind) for kind, value in before.items() if value * after[kind] < 0.0]
    found = [curve.advance(here, h, kind)[0] for h, kind in sorted(roots)]
    return [point for point in found if point.kind != "torus" or _is_torus(point.multipliers)]


def _root(curve: _Curve, here: _Point, kind: Kind, length: float) -> float:
    """Return the arclength from ``here`` at which a test function vanishes, to 1e-12 of the step."""

    def value(h: float) -> float:
        return _tests(curve.advance(here, h)[0] if h > 0.0 else here)[kind]

    try:
        if kind != "branch_point":
            return float(brentq(value, 0.0, length, xtol=1e-12 * length, rtol=1e-14))
    except NumericalError:  # the special point coincides with a branch point: approach it as near as possible
        pass
    return _bisect(value, length)


def _bisect(value: Callable[[float], float], length: float) -> float:
    """Return the arclength of a change of sign by bisection, as near as the corrector can get to a branch point."""
    lower, upper, sign = 0.0, length, value(0.0)
    while upper - lower > 1e-12 * length:
        middle = 0.5 * (lower + upper)
        try:
            same = value(middle) * sign > 0.0
        except NumericalError:  # the bordered matrix is singular at the branch point itself
            break
        lower, upper = (middle, upper) if same else (lower, middle)
    return lower


def _is_torus(multipliers: ComplexArray) -> bool:
    """Tell a complex pair on the unit circle from two real multipliers with product one (neutral saddle)."""
    a, b = min(combinations(multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return bool(abs(a.imag) > 1e-6 and abs(b.imag) > 1e-6)


def _branch(curve: _Curve, points: list[_Point], ends: tuple[End, End]) -> Branch:
    """Assemble the record in physical units."""
    u = np.array([point.v for point in points]) * curve.scale
    mu = np.array([point.multipliers for point in points])
    special = tuple(SpecialPoint(q.kind, i, float(u[i, -1])) for i, q in enumerate(points) if q.kind is not None)
    stable = np.all(np.abs(mu) < 1.0, axis=1)
    return Branch(u[:, :-1], u[:, -1], mu, stable, np.array([q.step for q in points]), special, ends)
