"""Harmonic balance: Jacobian, time integration, Floquet multipliers, agreement with the rotating frame."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.branch import ContinuationSettings
from romgen.continuation import solve_at
from romgen.forcing import harmonic_load
from romgen.periodic_orbit import HarmonicBalance, harmonic_balance
from romgen.reduced_model import ReducedModel
from romgen.rotating_frame import RotatingFrame, rotating_frame
from tests.normal_form_models import damped_oscillator, published_order7, resonant_pair

DUFFING = damped_oscillator(0.1, cubic=0.04)
ANYWHERE = ContinuationSettings((0.0, np.inf))


def balance_of(model: ReducedModel, level: float, mode: int = 0, harmonics: int = 9) -> HarmonicBalance:
    return harmonic_balance(model, harmonic_load(model, "load", level), mode, harmonics)


def solve(balance: HarmonicBalance, omega: float) -> FloatArray:
    return solve_at(balance, balance.start(balance.linear_response(omega), omega), omega, ANYWHERE)


@pytest.mark.parametrize(
    "balance", [balance_of(published_order7(), 1.0, harmonics=4), balance_of(resonant_pair(0.1, 0.01), 0.02, 1, 4)]
)
def test_jacobian_against_central_differences(balance: HarmonicBalance) -> None:
    omega = float(balance.eigenvalues[0].imag) * 1.02
    x = 0.05 * np.random.default_rng(3).standard_normal(4 * 9)
    _, F_x, F_p = balance.linearise(x, omega)
    h = 1e-6
    for j, e in enumerate(np.eye(x.size)):
        slope = (balance.linearise(x + h * e, omega)[0] - balance.linearise(x - h * e, omega)[0]) / (2.0 * h)
        # rounding eps F / h and truncation h^2 F''' of a field of slope abs(lambda)
        np.testing.assert_allclose(F_x[:, j], slope, atol=1e-6 * omega)
    slope = (balance.linearise(x, omega + h)[0] - balance.linearise(x, omega - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(F_p, slope, atol=1e-6 * omega)


@pytest.mark.parametrize("omega", [0.8, 1.7])
def test_orbit_of_the_oscillator_equation(omega: float) -> None:
    """The orbit must be a fixed point of the period map of x'' + 0.1 x' + x + 0.04 x^3 = cos(omega t)."""
    balance = balance_of(DUFFING, 1.0)
    state = solve(balance, omega)
    z = balance.orbits(state[None], np.array([omega]), 8)[0, :, 0]
    x, v = 2.0 * z.real, 2.0 * (DUFFING.eigenvalues[0] * z).real

    def rate(t: float, y: FloatArray) -> list[float]:
        return [y[1], np.cos(omega * t) - 0.1 * y[1] - y[0] - 0.04 * y[0] ** 3]

    period = 2.0 * np.pi / omega
    times = period * np.arange(9) / 8
    motion = solve_ivp(rate, (0.0, period), [x[0], v[0]], "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y
    # 9 harmonics of a hardening oscillator: the next odd one is of order 1e-6 of the first
    np.testing.assert_allclose(motion[0], np.append(x, x[0]), atol=3e-6)
    np.testing.assert_allclose(motion[1], np.append(v, v[0]), atol=3e-5)


def test_monodromy_against_the_variational_equation() -> None:
    balance = balance_of(DUFFING, 1.0)
    omega = 1.3
    state = solve(balance, omega)
    orders = np.arange(-9, 10)
    c = state[:19] + 1j * state[19:]

    def rate(t: float, y: FloatArray) -> FloatArray:
        x = 2.0 * (c @ np.exp(1j * orders * omega * t)).real
        A = np.array([[0.0, 1.0], [-1.0 - 0.12 * x**2, -0.1]])
        return (A @ y.reshape(2, 2)).ravel()

    period = 2.0 * np.pi / omega
    end = solve_ivp(rate, (0.0, period), np.eye(2).ravel(), "DOP853", rtol=1e-11, atol=1e-12).y[:, -1].reshape(2, 2)
    order = np.argsort(np.abs(balance.multipliers(state, omega)))
    expected = np.linalg.eigvals(end)
    # Magnus of order 4 with 128 steps per period: halving the step changes the multipliers by 1e-6
    np.testing.assert_allclose(np.abs(balance.multipliers(state, omega))[order], np.sort(np.abs(expected)), rtol=5e-6)


def test_liouville() -> None:
    """det(monodromy) = exp(-c T) for any orbit of an oscillator with damping c."""
    balance = balance_of(DUFFING, 1.0)
    monodromy = balance.monodromy(solve(balance, 0.9), 0.9)
    assert np.linalg.det(monodromy).real == pytest.approx(np.exp(-0.1 * 2.0 * np.pi / 0.9), rel=1e-12)


def both_routes(level: float, hz: float) -> tuple[RotatingFrame, FloatArray, HarmonicBalance, FloatArray, float]:
    model = published_order7(0.4)
    load, omega = harmonic_load(model, "load", level), 2.0 * np.pi * hz
    frame, balance = rotating_frame(model, load, 0), harmonic_balance(model, load, 0, 6)
    x = solve_at(frame, frame.start(frame.linear_response(omega), omega), omega, ANYWHERE)
    orbit = frame.orbits(x[None], np.array([omega]), 64)[0]
    return frame, x, balance, solve_at(balance, balance.state(orbit), omega, ANYWHERE), omega


def test_rotating_frame_is_the_resonant_part_of_the_complete_orbit() -> None:
    """All terms are resonant, so only the exp(-i Omega t) half of the load separates the two routes.

    It moves z1 by abs(f) / 2 omega to first order, and q by products of that with the nonlinear terms.
    """
    frame, x, balance, state, _ = both_routes(2.0, 107.0)
    q_frame, q_balance = frame.modal(x), balance.modal(state[None])[0]
    half = 0.4 / (2.0 * 693.0)
    assert np.max(np.abs(q_frame - q_balance)) < 0.05 * half
    difference = frame.orbits(x[None], np.array([2 * np.pi * 107.0]), 64) - balance.orbits(
        state[None], np.array([1.0]), 64
    )
    assert np.max(np.abs(difference)) < 0.1 * half  # without the first-order correction it would be half


def test_multipliers_of_both_routes_agree() -> None:
    frame, x, balance, state, omega = both_routes(2.0, 107.0)
    one, other = (np.array(sorted(s.multipliers(v, omega), key=np.angle)) for s, v in ((frame, x), (balance, state)))
    # the neglected half of the load is 3e-4 of z; a decay rate error of 1 % would show as 3e-4
    np.testing.assert_allclose(one, other, atol=1e-4)


def test_shift_by_one_forcing_period() -> None:
    """Driven at twice the first frequency, the shifted subharmonic changes sign in mode 1 and not in mode 2."""
    balance = balance_of(resonant_pair(0.1, 0.01), 0.03, mode=1, harmonics=4)
    x = balance.start(np.array([0.3 + 0.1j, 0.1j]), 2.0)
    moved = balance.modal(balance.shifted(x, 1)[None])[0]
    np.testing.assert_allclose(moved, [-0.3 - 0.1j, 0.1j], atol=1e-15)


def test_state_and_orbit_are_inverse() -> None:
    balance = dataclasses.replace(balance_of(DUFFING, 1.0), harmonics=3)
    x = np.random.default_rng(1).standard_normal(14)
    np.testing.assert_allclose(balance.state(balance.orbits(x[None], np.ones(1), 16)[0]), x, atol=1e-14)
