"""Loads of a study in the finite-element half: dead ones, and inputs by functions of time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem.excitation import Amplitude, TimeLoad, base_load, time_load
from fem.loads import Clamp, Force, Gravity, Load, PointForce, Pressure, Traction
from fem.model import Model
from romgen.settings import BASE_ACCELERATION, LoadSettings, Study


def still(_: float) -> float:
    """A load that is not there."""
    return 0.0


def dead_load(table: LoadSettings) -> Load:
    """A table [[loads]] as a load of ``fem``."""
    surface = table.surface or ""
    if table.total_force is not None:
        return Clamp(table.name, surface, table.total_force)
    if table.pressure is not None:
        return Pressure(table.name, surface, table.pressure)
    if table.traction is not None:
        return Traction(table.name, surface, table.traction)
    if table.acceleration is not None:
        return Gravity(table.name, table.acceleration)
    force = table.force or (0.0, 0.0, 0.0)
    if table.point is not None:
        return PointForce(table.name, table.point, force, table.body)
    return Force(table.name, surface, force)


def time_loads(study: Study, model: Model, amplitudes: Mapping[str, Amplitude]) -> tuple[TimeLoad, ...]:
    """The named load inputs of a study times functions of time, in the unit of each input.

    A base acceleration acts by the whole mass matrix: moving supports drag their neighbours along by its off-diagonal
    terms too.
    """
    return tuple(_time_load(study, model, name, amplitude) for name, amplitude in amplitudes.items())


def _time_load(study: Study, model: Model, name: str, amplitude: Amplitude) -> TimeLoad:
    if name == BASE_ACCELERATION:
        base = study.base_acceleration
        assert base is not None
        return base_load(model, base.direction, amplitude)
    table = study.excitations[name]
    if table.direction is None:
        return time_load(model, Pressure(name, table.surface or "", 1.0), amplitude)
    x, y, z = np.asarray(table.direction) / np.linalg.norm(table.direction)
    along = (float(x), float(y), float(z))
    if table.point is not None:
        return time_load(model, PointForce(name, table.point, along, table.body), amplitude)
    return time_load(model, Force(name, table.surface or "", along), amplitude)
