"""Whether free motions that start in the trained range decay: tried, not assumed.

From states on the boundary of the range, scaled by a factor, the model runs freely over HORIZON time constants of its
slowest mode. With the distance d of ``trained_range`` a motion decays when d has fallen below DECAYED of its start; its
mean rate is ln(d(0) / d(T)) / T. A linear model has exp(-HORIZON) left.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import qmc

from romgen.arrays import ComplexArray, FloatArray
from romgen.etdrk4 import march
from romgen.polynomial import PolynomialMap
from romgen.trained_range import TrainedRange

HORIZON, DECAYED = 2.0, 0.5
# Distances of the starts: the boundary of the range, and how far stability reaches beyond it.
FACTORS = (1.0, 1.25, 1.5, 2.0)
STARTS = 72
# Internal steps per period of the fastest mode, and intervals in which a motion is stored.
STEPS_PER_PERIOD, LOOKS = 20.0, 50


@dataclass(frozen=True)
class Stability:
    """Free motions from scaled boundaries of the trained range.

    Attributes
    ----------
    factor : (n_factor,) distance of the starts, 1 the boundary.
    share : (n_factor,) share of the motions that decay.
    slowest_rate : (n_factor,) smallest mean decay rate of any motion, 1/s; -inf where one diverges.
    linear_rate : -Re lambda of the slowest mode, 1/s, to compare with.
    starts : motions per factor.
    """

    factor: FloatArray = field(metadata={"unit": "1", "axes": "factor"})
    share: FloatArray = field(metadata={"unit": "1", "axes": "factor"})
    slowest_rate: FloatArray = field(metadata={"unit": "1/s", "axes": "factor"})
    linear_rate: float
    starts: int

    @property
    def is_stable(self) -> bool:
        """Whether all motions from the boundary of the trained range decay."""
        return bool(self.share[0] == 1.0)

    @property
    def reach(self) -> float:
        """Largest distance up to which all motions that were tried decay, 0 where those from the boundary do not."""
        lost = np.flatnonzero(self.share < 1.0)
        tried = self.factor if lost.size == 0 else self.factor[: lost[0]]
        return float(tried[-1]) if tried.size else 0.0


def tried_stability(
    eigenvalues: ComplexArray,
    normal_form: PolynomialMap[np.complex128],
    trained: TrainedRange,
    factors: tuple[float, ...] = FACTORS,
) -> Stability:
    """Simulate free motions of z' = Lambda z + N zeta^E from the scaled boundaries of the trained range.

    Parameters
    ----------
    eigenvalues : (m,) 1/s.
    normal_form : N, 1/s.
    factors : distances of the starts, the first 1.
    """
    slowest = float(-eigenvalues.real.max())
    t = np.linspace(0.0, HORIZON / slowest, LOOKS + 1)
    states = boundary_states(trained, STARTS)
    rates = np.array([[_mean_rate(eigenvalues, normal_form, trained, t, f * z) for z in states] for f in factors])
    least = np.log(1.0 / DECAYED) / t[-1]
    return Stability(
        factor=np.array(factors),
        share=(rates >= least).mean(axis=1),
        slowest_rate=rates.min(axis=1),
        linear_rate=slowest,
        starts=len(states),
    )


def boundary_states(trained: TrainedRange, n: int) -> ComplexArray:
    """Return n states z (n, m) with distance 1: each mode alone first, then a Halton sequence of shares and phases."""
    m = trained.facets.shape[1]
    sample = qmc.Halton(2 * m, scramble=False).random(n + 1)[1:]
    amplitude, phase = sample[:, :m] * trained.amplitude, 2.0 * np.pi * sample[:, m:]
    amplitude[:m] = np.diag(trained.amplitude)
    z = amplitude * np.exp(1j * phase)
    states: ComplexArray = z / trained.distance(z)[:, None]
    return states


def _mean_rate(
    eigenvalues: ComplexArray,
    normal_form: PolynomialMap[np.complex128],
    trained: TrainedRange,
    t: FloatArray,
    z0: ComplexArray,
) -> float:
    still = np.zeros((len(t) - 1, len(z0)), dtype=np.complex128)
    used = normal_form.coefficients.any(axis=0)
    E, N = normal_form.exponents[used], normal_form.coefficients[:, used]
    step = 2.0 * np.pi / (STEPS_PER_PERIOD * float(eigenvalues.imag.max()))
    last = march(t, z0, eigenvalues, E, N, still, still, step)[-1:]
    with np.errstate(over="ignore", invalid="ignore"):
        d0, d = float(trained.distance(z0[None])[0]), float(trained.distance(last)[0])
    return float(np.log(d0 / d)) / float(t[-1]) if np.isfinite(d) else float("-inf")
