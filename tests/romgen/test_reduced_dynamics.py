"""Linear part of the reduced dynamics: fitted, or kept from known modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.chart import ReducedTrajectory
from romgen.normal_form import fit_normal_form
from romgen.reduced_dynamics import LinearPart, fit_reduced_dynamics
from romgen.trajectory_fit import fit_on_trajectories

OMEGA, ZETA = np.array([6.0, 11.0]), np.array([0.01, 0.02])
EXACT = OMEGA * (-ZETA + 1j * np.sqrt(1.0 - ZETA**2))
KNOWN = LinearPart(OMEGA, ZETA)


def softening_decay(name: str, start: tuple[float, float]) -> ReducedTrajectory:
    """Two modes with -omega^2 sin(eta): all odd orders, so that a cubic bends its linear part."""
    t = np.linspace(0.0, 40.0, 4001)

    def rate(_: float, y: FloatArray) -> FloatArray:
        return np.concatenate([y[2:], -(OMEGA**2) * np.sin(y[:2]) - 2.0 * ZETA * OMEGA * y[2:]])

    y = solve_ivp(rate, (0.0, 40.0), [*start, 0.0, 0.0], "DOP853", t, rtol=1e-10, atol=1e-12).y.T
    y_dot = np.array([rate(0.0, row) for row in y])
    return ReducedTrajectory(name, t, y, y_dot, y[:, :1], y[:, 2:3])


@pytest.fixture(scope="module")
def decays() -> list[ReducedTrajectory]:
    return [softening_decay("first", (1.4, 0.0)), softening_decay("second", (0.3, 1.2))]


def test_a_fitted_linear_part_bends_to_large_amplitudes(decays: list[ReducedTrajectory]) -> None:
    """What a known one is for: sin x - (x - x^3/6) of the largest motion ends up in the frequency."""
    fitted = fit_reduced_dynamics(decays, 3, 0.0).eigenvalues
    assert np.all(np.abs(fitted / EXACT - 1.0) > 1e-4)


def test_known_modes_stay_in_the_vector_field(decays: list[ReducedTrajectory]) -> None:
    dynamics = fit_reduced_dynamics(decays, 3, 0.0, KNOWN)
    np.testing.assert_allclose(dynamics.eigenvalues, EXACT, rtol=1e-12)
    rest = fit_reduced_dynamics(decays, 3, 0.0).vector_field.coefficients[2:, 4:]
    assert not np.allclose(dynamics.vector_field.coefficients[2:, 4:], rest)


@pytest.mark.parametrize("method", [fit_normal_form, fit_on_trajectories])
def test_known_modes_stay_in_the_normal_form(decays: list[ReducedTrajectory], method: object) -> None:
    assert callable(method)
    fit = method(decays, 3, (), 1e-10, KNOWN)
    np.testing.assert_allclose(fit.dynamics.eigenvalues, EXACT, rtol=1e-12)


def test_known_modes_halve_the_error_of_small_motions(decays: list[ReducedTrajectory]) -> None:
    """A motion a tenth as large as the data turns at the known frequency, not at the bent one."""
    small = softening_decay("small", (0.14, 0.0))
    late = small.t > 30.0
    phase = np.unwrap(np.angle(small.y[:, 0] - 1j * small.y[:, 2] / OMEGA[0]))[late]
    measured = np.polyfit(small.t[late], phase, 1)[0]
    fitted = fit_reduced_dynamics(decays, 3, 0.0).eigenvalues.imag[0]
    assert abs(EXACT.imag[0] - measured) < 0.5 * abs(fitted - measured)
