"""Motions under base acceleration that the finite-element model is asked to march."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import FloatArray


@dataclass(frozen=True)
class ForcedMotion:
    """What the finite-element model is given: starts of all points and their base acceleration.

    Attributes
    ----------
    displacement, velocity : (n_dof, n_point) m from the equilibrium and m/s, at t = 0.
    level : (n_point,) m/s^2; omega : (n_point,) rad/s.
    n_step : time steps.
    """

    displacement: FloatArray = field(metadata={"unit": "m", "axes": "dof,point"})
    velocity: FloatArray = field(metadata={"unit": "m/s", "axes": "dof,point"})
    level: FloatArray = field(metadata={"unit": "m/s^2", "axes": "point"})
    omega: FloatArray = field(metadata={"unit": "rad/s", "axes": "point"})
    n_step: int

    def base_acceleration(self, t: float) -> FloatArray:
        """a cos(Omega t) of every point, (n_point,) m/s^2."""
        return np.asarray(self.level * np.cos(self.omega * t))
