"""Whether free motions that start in the trained range decay: tried, not assumed.

From states on the boundary of the range, scaled by a factor, the model runs freely over HORIZON time constants of its
slowest mode. With the distance d of ``trained_range`` a motion decays when d has fallen below DECAYED of its start; its
mean rate is ln(d(0) / d(T)) / T. A linear model has exp(-HORIZON) left.

Motions are followed by the scheme of ``variational``, whose steps are a good part of a period.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import qmc

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import NumericalError
from romgen.polynomial import PolynomialMap, jacobian, zeta
from romgen.trained_range import TrainedRange
from romgen.variational import motion

HORIZON, DECAYED = 2.0, 0.5
# Distances of the starts: the boundary of the range, and how far stability reaches beyond it.
FACTORS = (1.0, 1.25, 1.5, 2.0)
STARTS = 72
# Internal steps per period of the fastest mode: at least, and at most where terms turn or change fast.
FEWEST, MOST = 4.0, 20.0
# Largest turn of a detuned term and largest change by the nonlinear rates within a step.
LARGEST_TURN = 0.5
# Intervals after which the step is chosen anew, and steps that a motion may take: two minutes for all of order 7.
INTERVALS, LARGEST_COUNT = 10, 400_000
# Distance at which a motion counts as divergent.
LOST = 100.0


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

    Raises
    ------
    NumericalError : the slowest mode decays so slowly that its motions cannot be followed.
    """
    slowest = float(-eigenvalues.real.max())
    horizon = HORIZON / slowest
    _require_short(horizon, eigenvalues)
    states = boundary_states(trained, STARTS)
    rates = np.array([_mean_rates(eigenvalues, normal_form, trained, horizon, factor * states) for factor in factors])
    least = np.log(1.0 / DECAYED) / horizon
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


def _mean_rates(
    eigenvalues: ComplexArray,
    normal_form: PolynomialMap[np.complex128],
    trained: TrainedRange,
    horizon: float,
    start: ComplexArray,
) -> FloatArray:
    """Mean decay rates (n,) in 1/s of the motions from ``start`` (n, m), -inf where one diverges."""
    z, terms = start.copy(), (normal_form.exponents, normal_form.coefficients)
    interval = np.array([0.0, horizon / INTERVALS])
    for _ in range(INTERVALS):
        alive = np.flatnonzero(trained.distance(z) <= LOST)
        for k, step in zip(alive, _steps(eigenvalues, normal_form, trained, z[alive]), strict=True):
            z[k] = motion(interval, z[k], eigenvalues, terms, float(step))[1]
    end = np.maximum(trained.distance(z), np.finfo(float).tiny)
    rates = np.full(len(z), -np.inf)
    kept = end <= LOST
    rates[kept] = np.log(trained.distance(start[kept]) / end[kept]) / horizon
    return rates


def _steps(
    eigenvalues: ComplexArray, normal_form: PolynomialMap[np.complex128], trained: TrainedRange, z: ComplexArray
) -> FloatArray:
    """Internal steps (n,) in s at states z (n, m), by the rates of the nonlinear terms there and their detunings."""
    m, omega = len(eigenvalues), eigenvalues.imag
    rho = np.tile(trained.amplitude, 2)
    slopes = jacobian(normal_form, zeta(z)) * rho / rho[:m, None]
    net = normal_form.exponents[:, :m] - normal_form.exponents[:, m:]
    detuning = np.abs((net @ omega)[None] - omega[:, None])[normal_form.coefficients != 0.0].max(initial=0.0)
    rate = np.maximum(np.linalg.norm(slopes, 2, axis=(1, 2)), max(detuning, np.finfo(float).tiny))
    turn = 2.0 * np.pi / float(omega.max())
    steps: FloatArray = np.clip(LARGEST_TURN / rate, turn / MOST, turn / FEWEST)
    return steps


def _require_short(horizon: float, eigenvalues: ComplexArray) -> None:
    count = FEWEST * horizon * float(eigenvalues.imag.max()) / (2.0 * np.pi)
    if not count <= LARGEST_COUNT:
        slowest = int(eigenvalues.real.argmax())
        rate, frequency = -float(eigenvalues.real[slowest]), float(eigenvalues.imag[slowest]) / (2.0 * np.pi)
        raise NumericalError(
            "a mode decays so slowly that no motion of the model can be followed until it has decayed",
            where="stability",
            value=f"{rate:.3g} 1/s at {frequency:.6g} Hz",
            advice="check the number of master modes and the start time, or give records in which every mode decays",
        )
