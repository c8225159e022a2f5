"""Coefficients of the generalised-alpha method and what it makes of a linear mode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fem.arrays import FloatArray
from fem.errors import FemInputError


@dataclass(frozen=True)
class Scheme:
    """Coefficients of generalised-alpha for a spectral radius rho at infinite frequency."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @staticmethod
    def from_radius(rho: float) -> Scheme:
        """Second order, unconditionally stable for 0 <= rho <= 1 (Chung & Hulbert, eqs. 17, 20, 25)."""
        if not 0.0 <= rho <= 1.0:
            raise FemInputError("spectral radius must lie in [0, 1]", where="transient", value=rho)
        alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
        difference = 1.0 - alpha_m + alpha_f
        return Scheme(alpha_m, alpha_f, 0.25 * difference**2, 0.5 - alpha_m + alpha_f)

    def timely(self, a: FloatArray, rise: FloatArray) -> FloatArray:
        """u'' at the end of a step from its ``a``, which stands for a time (af - am) h earlier, and its ``rise``."""
        return a + (self.alpha_f - self.alpha_m) * rise

    def discrete_frequency(self, omega: float, step: float) -> float:
        """Frequency in rad/s with which the scheme oscillates for an undamped mode omega at that time step."""
        w = (omega * step) ** 2
        am, af, b, g = self.alpha_m, self.alpha_f, self.beta, self.gamma
        # State (u, h v, h^2 a): left @ new = right @ old.
        left = np.array([[(1.0 - af) * w, 0.0, 1.0 - am], [1.0, 0.0, -b], [0.0, 1.0, -g]])
        right = np.array([[-af * w, 0.0, -am], [1.0, 1.0, 0.5 - b], [0.0, 1.0, 1.0 - g]])
        values = np.linalg.eigvals(np.linalg.solve(left, right))
        return float(np.abs(np.angle(values[np.abs(values.imag).argmax()])) / step)

    def frequency_corrected_inertia(self, omega: float, step: float) -> float:
        """Relative inertia to add to a mode so that the scheme oscillates at its true frequency omega.

        The scheme turns x into discrete_frequency(x, h); with x the root of discrete_frequency(x, h) = omega the modal
        inertia 1 + r = (omega / x)^2 does it. Needs omega h <= 1.
        """
        if omega * step > 1.0:
            advice = "use a smaller time step, or settings with dispersion_correction=False or fewer corrected_modes"
            raise FemInputError(
                "time step too large for the mode", where="transient", value=omega * step, advice=advice
            )
        root = brentq(lambda x: self.discrete_frequency(x, step) - omega, 0.5 * omega, 2.0 * omega, xtol=1e-14 * omega)
        return float((omega / root) ** 2 - 1.0)
