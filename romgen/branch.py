"""Records of a continuation: the system to solve, the settings, the solution branch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

from romgen.arrays import BoolArray, ComplexArray, FloatArray

Kind = Literal["fold", "torus", "period_doubling", "branch_point"]
End = Literal["range", "limit", "closed", "points", "stalled"]


class ParameterSystem(Protocol):
    """An algebraic system F(x, p) = 0 whose solutions are periodic orbits or equilibria."""

    def linearise(self, x: FloatArray, p: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return F (n,), F_x (n, n) and F_p (n,)."""

    def multipliers(self, x: FloatArray, p: float) -> ComplexArray:
        """Return the Floquet multipliers; of an equilibrium exp(eigenvalue times any fixed time)."""


@dataclass(frozen=True)
class ContinuationSettings:
    """Range, scales and step control; arclength is measured in (x / state_scale, p / parameter_scale).

    Attributes
    ----------
    parameter_range : where to stop.
    state_scale, parameter_scale : units of x and p along the branch.
    first_step, smallest_step, largest_step : arclength steps.
    turn : largest angle between consecutive tangents, rad.
    tolerance : Newton stops when its update is below this (scaled variables).
    iterations : Newton iterations before the step is cut.
    points : largest number of points in each direction.
    state_limit : the branch ends where max abs(x) exceeds it.
    """

    parameter_range: tuple[float, float]
    state_scale: float = 1.0
    parameter_scale: float = 1.0
    first_step: float = 0.02
    smallest_step: float = 1e-8
    largest_step: float = 0.25
    turn: float = 0.12
    tolerance: float = 1e-9
    iterations: int = 8
    points: int = 4000
    state_limit: float = float("inf")


@dataclass(frozen=True)
class SpecialPoint:
    """A located fold, torus (Neimark-Sacker, Hopf of the rotating frame), period doubling or branch point.

    Attributes
    ----------
    kind : which test function vanishes.
    index : its row in the branch.
    p : parameter there.
    """

    kind: Kind
    index: int
    p: float


@dataclass(frozen=True)
class Branch:
    """A solution branch, ordered along its arclength; special points are rows of it.

    Attributes
    ----------
    x : (n, n_state) states.
    p : (n,) parameters.
    multipliers : (n, n_multiplier) Floquet multipliers.
    stable : (n,) all multipliers inside the unit circle.
    steps : (n,) arclength step that led to each row, 0 at the start.
    special : located special points.
    ends : why the branch ends at its first and last row.
    """

    x: FloatArray = field(metadata={"unit": "mixed", "axes": "point,state"})
    p: FloatArray = field(metadata={"unit": "mixed", "axes": "point"})
    multipliers: ComplexArray = field(metadata={"unit": "1", "axes": "point,multiplier"})
    stable: BoolArray = field(metadata={"unit": "1", "axes": "point"})
    steps: FloatArray = field(metadata={"unit": "1", "axes": "point"})
    special: tuple[SpecialPoint, ...]
    ends: tuple[End, End]

    def located(self, kind: Kind) -> tuple[SpecialPoint, ...]:
        """Return the special points of one kind in branch order."""
        return tuple(point for point in self.special if point.kind == kind)
