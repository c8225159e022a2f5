"""What follows any function of time: dead loads and nodal patterns, a moving base, supports that move by themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.body import locate
from fem.errors import FemInputError
from fem.finite_values import finite_array
from fem.loads import Assembly, Load, load_vector
from fem.model import AXES, Model

Amplitude = Callable[[float], FloatArray | float]
"""t in s -> one value for all cases or (n_case,) values."""


@dataclass(frozen=True)
class TimeLoad:
    """p(t) = pattern amplitude(t): ``pattern`` (n_dof,) N per unit of the amplitude, on top of the dead loads."""

    name: str
    pattern: FloatArray
    amplitude: Amplitude

    def at(self, t: float, n_case: int) -> FloatArray:
        """Amplitudes of all cases, (n_case,); one that is not finite or has another shape raises ``FemInputError``."""
        return _values(self.name, self.amplitude, t, n_case)


@dataclass(frozen=True)
class SupportMotion:
    """u_held(t) = equilibrium + pattern amplitude(t): ``pattern`` (n_dof,) m per unit, zero where no support holds."""

    name: str
    pattern: FloatArray
    amplitude: Amplitude

    def at(self, t: float, n_case: int) -> FloatArray:
        """Amplitudes of all cases, (n_case,); raises as ``TimeLoad.at``."""
        return _values(self.name, self.amplitude, t, n_case)

    def rates(self, step: float, n_case: int) -> tuple[FloatArray, FloatArray]:
        """First and second derivative at t = 0, (n_case,), by forward differences of second order over ``step`` s."""
        f = [self.at(k * step, n_case) for k in range(4)]
        return (-3.0 * f[0] + 4.0 * f[1] - f[2]) / (2.0 * step), (2.0 * f[0] - 5.0 * f[1] + 4.0 * f[2] - f[3]) / step**2


def _values(name: str, amplitude: Amplitude, t: float, n_case: int) -> FloatArray:
    value = np.asarray(amplitude(t), dtype=np.float64)
    if not np.all(np.isfinite(value)):
        advice = "check the time function of this load"
        raise FemInputError(f"load is not finite at t = {t:.6g} s", where=name, value=str(value), advice=advice)
    if value.shape not in ((), (1,), (n_case,)):
        advice = f"give one value, or one for each of the {n_case} cases"
        raise FemInputError("load has the wrong number of amplitudes", where=name, value=value.shape, advice=advice)
    return np.broadcast_to(value, (n_case,))


def support_motion(
    model: Model, region: str, directions: Sequence[str], displacement: Amplitude, *, vector: Sequence[float] = (1.0,)
) -> SupportMotion:
    """Held components of "<body>.<surface or set>" move by ``displacement`` m as a function of time, 0 at t = 0.

    Parameters
    ----------
    directions : among "x", "y", "z"; every node of the region must be held along them by a ``Support``.
    vector : factors of the displacement, one for all directions or one for each.

    Raises
    ------
    FemInputError : unknown names or directions, components that are not held, another number of factors, a motion that
        does not start at 0.
    """
    where = f"motion of {region}"
    index, name = locate(model.bodies, region, where=where)
    nodes = model.bodies[index].mesh.nodes(name, where=where) + model.offsets[index]
    unknown = [direction for direction in directions if direction not in AXES]
    if unknown:
        raise FemInputError("unknown direction", where=where, value=unknown[0], advice="choose x, y or z")
    pattern = np.zeros(model.n_dof)
    advice = f"give one factor, or one for each of the {len(directions)} directions"
    factors = finite_array(vector, (-1,), "the vector", where=where, advice=advice)
    if len(factors) not in (1, len(directions)):
        raise FemInputError("the vector has the wrong length", where=where, value=len(factors), advice=advice)
    factors = np.broadcast_to(factors, (len(directions),))
    for direction, factor in zip(directions, factors, strict=True):
        dof = 3 * nodes + AXES[direction]
        if model.free[dof].any():
            advice = "hold the region by a Support along this direction"
            raise FemInputError("only held components can be moved", where=where, value=direction, advice=advice)
        pattern[dof] = factor
    motion = SupportMotion(where, pattern, displacement)
    if np.any(np.asarray(displacement(0.0)) != 0.0):
        advice = "start from the static state with the support displaced, and let the motion begin at 0"
        raise FemInputError("the motion does not start at 0", where=where, value=str(displacement(0.0)), advice=advice)
    return motion


def time_load(model: Model, load: Load, amplitude: Amplitude) -> TimeLoad:
    """A force, traction, pressure or gravity of ``loads`` times a function of time."""
    assembly = Assembly(model.bodies, model.offsets, model.points, model.mass)
    return TimeLoad(load.name, load_vector(load, assembly), amplitude)


def base_load(model: Model, direction: str, acceleration: Amplitude) -> TimeLoad:
    """All supports move with ``acceleration`` m/s^2 along an axis; the motion is relative to them: p = -M b a(t)."""
    if direction not in AXES:
        raise FemInputError("unknown direction", where="base acceleration", value=direction, advice="choose x, y or z")
    return TimeLoad("base acceleration", -(model.mass @ model.direction(direction)), acceleration)
