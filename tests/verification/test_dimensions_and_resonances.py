"""Models of two, four and six dimensions, with and without internal resonance: found and predicted.

Oscillators x_j'' + 2 zeta w_j x_j' + w_j^2 x_j + dU/dx_j = 0 with U = c (sum x)^3 / 3 + (sum x)^4 / 4: every quadratic
and cubic term couples. Trajectories carry exact derivatives.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.chart import ReducedTrajectory
from romgen.learn import assemble
from romgen.normal_form import fit_normal_form
from romgen.settings import LearnSettings
from romgen.trajectory import Trajectory
from romgen.trajectory_error import trajectory_error

ZETA, QUADRATIC = 0.004, 0.3
CASES = {
    "2D": ((1.0,), ()),
    "4D": ((1.0, 1.47), ()),
    "4D 1:1": ((1.0, 1.03), (1, 1)),
    "4D 1:2": ((1.0, 1.94), (1, 2)),
    "4D 1:3": ((1.0, 3.05), (1, 3)),
    "6D 1:2:3": ((1.0, 2.03, 2.97), (1, 2, 3)),
}


def decay(omega: FloatArray, start: FloatArray) -> ReducedTrajectory:
    """Return 15 periods of the slowest mode from rest."""
    m, t = omega.size, np.arange(0.0, 30.0 * np.pi, 0.05)

    def acceleration(x: FloatArray, v: FloatArray) -> FloatArray:
        s = x.sum(axis=0)
        return -2 * ZETA * (omega * v.T).T - (omega**2 * x.T).T - QUADRATIC * s**2 - s**3

    def rate(_: float, s: FloatArray) -> FloatArray:
        return np.concatenate([s[m:], acceleration(s[:m], s[m:])])

    s = solve_ivp(rate, (0, t[-1]), [*start, *np.zeros(m)], "DOP853", t, rtol=1e-9, atol=1e-12).y
    y_dot = np.vstack([s[m:], acceleration(s[:m], s[m:])]).T
    return ReducedTrajectory("decay", t, s.T, y_dot, s[:m].T, s[m:].T)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_resonance_is_found_and_a_held_out_motion_predicted(case: str) -> None:
    frequencies, integers = CASES[case]
    omega, m = np.array(frequencies), len(frequencies)
    corners = np.eye(m) if m == 1 else np.vstack([np.eye(m), np.full(m, 0.7)])
    training = [decay(omega, 0.12 * corner / omega) for corner in corners]
    fit = fit_normal_form(training, 3, "auto", 0.0)
    assert fit.resonance.internal_resonance == integers
    assert str(fit.resonance.reason)
    exact = -ZETA * omega + 1j * omega * np.sqrt(1 - ZETA**2)
    # the vector field is a cubic polynomial, so that the fit is exact up to the integration
    assert fit.dynamics.eigenvalues == pytest.approx(exact, rel=1e-5)
    names = tuple(f"x{j}" for j in range(m))
    model = assemble("oscillators", fit, training, LearnSettings(), names, None)
    held_out = decay(omega, 0.06 * np.linspace(1.0, 0.6, m) / omega)
    trajectory = Trajectory("held out", held_out.t, names, held_out.displacement)
    # the cut terms shift the frequency by the fourth power of the total amplitude, 0.13^4 times 94 rad of phase
    assert trajectory_error(model, held_out, trajectory, None).sensor_nmte_percent < 100.0 * 0.13**4 * 94.0
