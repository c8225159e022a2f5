"""Loads that follow any function of time: at points, on surfaces, and by accelerating the base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.model import AXES, Model
from fem.pairing import surface_points
from fem.sensor import Sensor, sensor_rows

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


def point_load(
    model: Model, point: tuple[float, float, float], direction: str, amplitude: Amplitude, *, name: str = "point load"
) -> TimeLoad:
    """A force of ``amplitude`` N at a material point: by its shape functions, as a sensor reads a displacement."""
    row = sensor_rows(model, [Sensor(name, point, direction)])[0]
    return TimeLoad(name, row * model.free, amplitude)


def surface_load(
    model: Model, surface: str, direction: str, amplitude: Amplitude, *, name: str = "surface load"
) -> TimeLoad:
    """A uniform dead traction on surface "<body>.<surface>" that sums to ``amplitude`` N along ``direction``.

    ``direction`` is "x", "y", "z", or "normal" for a pressure: positive amplitudes then press against the surface and
    ``amplitude`` is pressure times area.
    """
    at = surface_points(model.points, model.facets(surface))
    if direction == "normal":
        axis = -at.normals
    elif direction in AXES:
        axis = np.tile(np.eye(3)[AXES[direction]], (len(at.area), 1))
    else:
        advice = "choose x, y, z or normal"
        raise FemInputError("unknown direction", where=name, value=direction, advice=advice)
    density = at.area[:, None] / at.area.sum() * axis
    pattern = np.zeros((len(model.points), 3))
    np.add.at(pattern, at.nodes, at.shape[:, :, None] * density[:, None, :])
    return TimeLoad(name, pattern.ravel() * model.free, amplitude)


def base_load(model: Model, direction: str, acceleration: Amplitude) -> TimeLoad:
    """All supports move with ``acceleration`` m/s^2 along an axis; the motion is relative to them: p = -M b a(t)."""
    if direction not in AXES:
        raise FemInputError("unknown direction", where="base acceleration", value=direction, advice="choose x, y or z")
    return TimeLoad("base acceleration", -(model.mass @ model.direction(direction)), acceleration)
