"""Dissipation in and around the trained range, as a penalty on the coefficients of a normal form.

A weighted energy of the modes must fall at a share of its linear rate. With V = sum_j w_j abs(z_j)^2 / a_j^2,

    r(z) = V' / abs(V'_linear) = sum_j w_j Re(conj z_j z_j') / a_j^2 / sum_j w_j alpha_j abs(z_j)^2 / a_j^2,

z' = Lambda z + B phi(z), a the trained amplitudes and alpha = -Re lambda of the linear part: r = -1 where nothing is
nonlinear. Missing is h = max(0, kappa + r) of the demanded share kappa, at states on shells in and around the range;
the penalty is the mean of h^2. r is linear in Lambda and B, so its derivative is exact. The weights w are those for
which the penalty is smallest: with integers r_j of the internal resonance, conservative resonant terms keep
sum_j r_j I_j of the actions I_j (Manley and Rowe 1956), such a sum near z = 0, so weights exist for which they cancel.
Where r < 0 on all shells up to the level set of V through a state, its free motion decays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import qmc

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.polynomial import monomials, zeta
from romgen.trained_range import TrainedRange

# Shells in units of the trained one and the share of the linear rate that is demanded there. Beyond the range the model
# extrapolates; that it does not gain energy there is all that is asked, and the highest degrees would not give it.
Shell = tuple[float, float]
SHELLS: tuple[Shell, ...] = ((0.5, 0.3), (0.75, 0.3), (1.0, 0.3), (1.25, 0.2), (1.5, 0.1), (1.75, 0.0), (2.0, 0.0))
STATES = 108
# Weight of the mean square of what is missing beside the relative mean square misfit of a fit.
PENALTY = 10.0
# Half the width of ln w that is searched: level sets of V stay within sqrt(2) of the shells. Its tolerance.
LOG_WEIGHT, TOLERANCE = 0.7, 1e-3


@dataclass(frozen=True)
class Demand:
    """Where dissipation is demanded, and how much.

    Attributes
    ----------
    states : (n, m) z; share : (n,) kappa.
    amplitude : (m,) a; damping : (m,) alpha, 1/s.
    """

    states: ComplexArray = field(metadata={"unit": "1", "axes": "state,mode"})
    share: FloatArray = field(metadata={"unit": "1", "axes": "state"})
    amplitude: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    damping: FloatArray = field(metadata={"unit": "1/s", "axes": "mode"})


@dataclass(frozen=True)
class Hinge:
    """What is missing of the demanded dissipation.

    Attributes
    ----------
    value : (n,) h >= 0; slope : (n, n_unknown) dh, in (Re, Im) pairs of Lambda, then B row by row; weights : (m,) w.
    """

    value: FloatArray = field(metadata={"unit": "1", "axes": "state"})
    slope: FloatArray = field(metadata={"unit": "mixed", "axes": "state,unknown"})
    weights: FloatArray = field(metadata={"unit": "1", "axes": "mode"})


def demand(trained: TrainedRange, eigenvalues: ComplexArray, shells: tuple[Shell, ...] = SHELLS) -> Demand:
    """Return states on scaled surfaces around the trained range.

    The surface is the ellipsoid through the largest amplitudes or the boundary of the range, whichever is farther out:
    free motions exchange energy and leave the range along such ellipsoids.

    Parameters
    ----------
    eigenvalues : (m,) reference, 1/s.
    shells : distance and demanded share of each.
    """
    a = trained.amplitude
    m = len(a)
    sample = qmc.Halton(2 * m, scramble=False).random(STATES + 1)[1:]
    x = np.vstack([np.eye(m), sample[m:, :m] ** 0.5])
    x /= np.minimum(np.linalg.norm(x, axis=1), trained.distance(x * a))[:, None]
    surface = x * a * np.exp(2j * np.pi * sample[:, m:])
    return Demand(
        states=np.vstack([radius * surface for radius, _ in shells]),
        share=np.repeat([share for _, share in shells], len(surface)),
        amplitude=a,
        damping=-eigenvalues.real,
    )


def hinge(where: Demand, exponents: IntArray, resonant: BoolArray, unknowns: FloatArray) -> Hinge:
    """Return h with the best weights, and its derivative (that of w drops out at the optimum of the sum of h^2).

    Parameters
    ----------
    exponents : (n_term, 2m); resonant : (m, n_term) terms of B.
    unknowns : (n_unknown,) (Re, Im) pairs of Lambda and of B[resonant].
    """
    power = _power(where, exponents, resonant)
    rate = power @ unknowns
    linear = where.damping[:, None] * _share(where)

    def values(w: FloatArray) -> FloatArray:
        h: FloatArray = np.maximum(0.0, where.share + (w @ rate) / (w @ linear))
        return h

    w = _weights(values, len(where.amplitude))
    h = values(w)
    slope = np.einsum("j,jsn->sn", w, power) / (w @ linear)[:, None]
    slope[h <= 0.0] = 0.0
    return Hinge(h, slope, w)


def penalty(
    where: Demand | None, exponents: IntArray, resonant: BoolArray, values: tuple[ComplexArray, ComplexArray]
) -> tuple[float, FloatArray, FloatArray]:
    """Return PENALTY mean h^2, half its gradient and its Gauss-Newton Hessian; zeros where nothing is demanded.

    Parameters
    ----------
    values : Lambda (m,) and B (m, n_term), 1/s; derivatives are by their (Re, Im) pairs, B[resonant] only.
    """
    numbers = np.concatenate([values[0], values[1][resonant]])
    unknowns = np.column_stack([numbers.real, numbers.imag]).ravel()
    if where is None:
        return 0.0, np.zeros(len(unknowns)), np.zeros((len(unknowns), len(unknowns)))
    missing = hinge(where, exponents, resonant, unknowns)
    share = PENALTY / len(missing.value)
    J, h = missing.slope, missing.value
    return share * float(h @ h), share * J.T @ h, share * J.T @ J


def _share(where: Demand) -> FloatArray:
    """Return abs(z_j)^2 / a_j^2, (m, n)."""
    share: FloatArray = (np.abs(where.states) / where.amplitude).T ** 2
    return share


def _power(where: Demand, exponents: IntArray, resonant: BoolArray) -> FloatArray:
    """Return d/dunknown of Re(conj z_j z_j') / a_j^2, (m, n, n_unknown)."""
    rows, terms = np.nonzero(resonant)
    m = len(where.amplitude)
    phi = monomials(zeta(where.states), exponents[terms])
    product = np.hstack([where.states, phi]) * where.states.conj()[:, np.concatenate([np.arange(m), rows])]
    pairs = np.stack([product.real, -product.imag], axis=-1).reshape(len(product), -1)
    own = np.concatenate([np.arange(m), rows])[None, :] == np.arange(m)[:, None]
    power: FloatArray = pairs * np.repeat(own, 2, axis=1)[:, None] / where.amplitude[:, None, None] ** 2
    return power


def _weights(values: Callable[[FloatArray], FloatArray], m: int) -> FloatArray:
    """Return w (m,), the first 1, for which the sum of squares of the values is smallest, one mode after the other."""
    logarithm = np.zeros(m)

    def cost(x: float, j: int) -> float:
        trial = logarithm.copy()
        trial[j] = x
        return float(np.sum(values(np.exp(trial)) ** 2))

    for j in list(range(1, m)) * min(2, m - 1):
        grid = np.linspace(-LOG_WEIGHT, LOG_WEIGHT, 17)
        best = int(np.argmin([cost(x, j) for x in grid]))
        bounds = grid[max(best - 1, 0)], grid[min(best + 1, 16)]
        logarithm[j] = minimize_scalar(cost, bounds=bounds, args=(j,), method="bounded", options={"xatol": TOLERANCE}).x
    weights: FloatArray = np.exp(logarithm)
    return weights
