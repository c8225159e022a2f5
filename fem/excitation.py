"""Loads that follow any function of time: the dead loads of ``loads``, any nodal pattern, and a moving base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
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
        value = np.asarray(self.amplitude(t), dtype=np.float64)
        if not np.all(np.isfinite(value)):
            advice = "check the time function of this load"
            raise FemInputError(
                f"load is not finite at t = {t:.6g} s", where=self.name, value=str(value), advice=advice
            )
        if value.shape not in ((), (1,), (n_case,)):
            advice = f"give one value, or one for each of the {n_case} cases"
            raise FemInputError(
                "load has the wrong number of amplitudes", where=self.name, value=value.shape, advice=advice
            )
        return np.broadcast_to(value, (n_case,))


def time_load(model: Model, load: Load, amplitude: Amplitude) -> TimeLoad:
    """A force, traction, pressure or gravity of ``loads`` times a function of time."""
    assembly = Assembly(model.bodies, model.offsets, model.points, model.mass)
    return TimeLoad(load.name, load_vector(load, assembly), amplitude)


def base_load(model: Model, direction: str, acceleration: Amplitude) -> TimeLoad:
    """All supports move with ``acceleration`` m/s^2 along an axis; the motion is relative to them: p = -M b a(t)."""
    if direction not in AXES:
        raise FemInputError("unknown direction", where="base acceleration", value=direction, advice="choose x, y or z")
    return TimeLoad("base acceleration", -(model.mass @ model.direction(direction)), acceleration)
