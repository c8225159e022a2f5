"""Motions under given loads that the finite-element model is asked to march."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import FloatArray

Amplitude = Callable[[float], FloatArray]
"""t in s -> the amplitudes of all points, (n_point,)."""


@dataclass(frozen=True)
class ForcedMotion:
    """What the finite-element model is given: starts of all points and their loads.

    Attributes
    ----------
    displacement, velocity : (n_dof, n_point) m from the equilibrium and m/s, at t = 0.
    loads : function of time of each load input that acts, in its unit.
    n_step : time steps.
    """

    displacement: FloatArray = field(metadata={"unit": "m", "axes": "dof,point"})
    velocity: FloatArray = field(metadata={"unit": "m/s", "axes": "dof,point"})
    loads: Mapping[str, Amplitude]
    n_step: int


def cosine(level: FloatArray, omega: FloatArray) -> Amplitude:
    """level cos(omega t) of every point; level (n_point,) in the unit of the input, omega (n_point,) rad/s."""

    def at(t: float) -> FloatArray:
        return np.asarray(level * np.cos(omega * t))

    return at
