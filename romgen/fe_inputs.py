"""The load inputs of a study in the finite-element half: a moving base, forces and pressures, by functions of time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem.excitation import Amplitude, TimeLoad, base_load, time_load
from fem.loads import Force, PointForce, Pressure
from fem.model import Model
from romgen.settings import BASE_ACCELERATION, Study


def still(_: float) -> float:
    """A load that is not there."""
    return 0.0


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
        return time_load(model, PointForce(name, table.point, along), amplitude)
    return time_load(model, Force(name, table.surface or "", along), amplitude)
