"""V24, V25: backbones of undamped oscillators, from analytic normal forms and from harmonic balance."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.special import ellipk

from romgen.arrays import FloatArray
from romgen.backbone import Backbone, backbone
from romgen.forcing import harmonic_load
from romgen.periodic_orbit import harmonic_balance
from romgen.polynomial import PolynomialMap
from tests.normal_form_models import averaged_oscillator, damped_oscillator, linear_charts

# Exact omega(A) of x'' + x + x^3 = 0, VERIFICATION V24.
EXACT = {0.1: 1.0037418, 0.3: 1.0331128, 0.5: 1.0891582, 1.0: 1.3177761, 2.0: 1.9760164}


def exact(A: FloatArray) -> FloatArray:
    """omega(A) = pi sqrt(1 + A^2) / (2 K(m)), m = A^2 / (2 (1 + A^2))."""
    return np.asarray(np.pi * np.sqrt(1.0 + A**2) / (2.0 * ellipk(0.5 * A**2 / (1.0 + A**2))))


def duffing_backbone(order: int) -> Backbone:
    """Normal form of order 3 or 5 in the fundamental amplitude a = 2 rho, with the third harmonic in the chart.

    omega = 1 + 3/8 a^2 - 15/256 a^4,  x = a cos(theta) + a^3 / 32 cos(3 theta) = 2 Re(z + z^3 / 8).
    """
    E, C = np.array([[2, 1], [3, 2]]), np.array([[1.5j, -15j / 16.0]])
    kept = order // 2
    model = linear_charts(np.array([1j]), PolynomialMap(E[:kept], C[:, :kept]), np.array([-0.5j]))
    if order == 5:
        chart = PolynomialMap(np.array([[1, 0], [3, 0]]), np.array([[2.0, 0.25], [-2j, 0.0]]))
        model = dataclasses.replace(model, chart=chart)
    return backbone(model, rho=0.5 * np.array([0.1, 0.2, 0.3, 0.4, 0.5]))


def test_reference_values_are_the_elliptic_integral() -> None:
    np.testing.assert_allclose(exact(np.array(list(EXACT))), list(EXACT.values()), atol=5e-8)


@pytest.mark.parametrize(("order", "power", "bound"), [(3, 4, 21.0 / 256.0), (5, 6, 0.03)])
def test_v24_error_is_the_next_term(order: int, power: int, bound: float) -> None:
    """In the peak A the series is 1 + 3/8 A^2 - 21/256 A^4 + O(0.03 A^6), which bounds the truncation.

    The -15/256 of textbooks belongs to the fundamental amplitude: A = a + a^3 / 32.
    """
    curve = duffing_backbone(order)
    A = curve.amplitude_max[:, 0]
    error = np.abs(2.0 * np.pi * curve.frequency_hz - exact(A))
    assert np.all(error < bound * A**power)
    slope = np.polyfit(np.log(A), np.log(error), 1)[0]
    assert slope == pytest.approx(power, abs=0.35)


@pytest.mark.parametrize(("gamma", "slope"), [(1.5j, 3.0 / 8.0), (1j * (1.5 - 5.0 / 3.0), -1.0 / 24.0)])
def test_slope_from_the_cubic_coefficient(gamma: complex, slope: float) -> None:
    """V25: the quadratic terms contribute -5/12 to the slope, which turns hardening 3/8 into softening -1/24."""
    curve = backbone(averaged_oscillator(gamma), rho=np.array([0.005]))
    assert (2.0 * np.pi * curve.frequency_hz[0] - 1.0) / 0.01**2 == pytest.approx(slope, rel=1e-8)


def conservative_frequency(quadratic: float, positive_peak: float, harmonics: int) -> float:
    """omega of the undamped, unforced oscillator at x(0) = A by harmonic balance: real c_k, unknowns c and Omega."""
    model = damped_oscillator(0.0, quadratic, 1.0)
    balance = harmonic_balance(model, harmonic_load(model, "load", 0.0), 0, harmonics)
    n = 2 * harmonics + 1

    def residual(u: FloatArray) -> FloatArray:
        F, _, _ = balance.linearise(np.append(u[:n], np.zeros(n)), u[n])
        return np.append(F[n:], 2.0 * np.sum(u[:n]) - positive_peak)

    start = np.zeros(n + 1)
    start[harmonics + 1] = 0.5 * positive_peak
    start[n] = 1.0 + (0.3 if quadratic == 0.0 else 0.0) * positive_peak**2 / (1.0 + 0.3 * positive_peak)
    return float(fsolve(residual, start, xtol=1e-13)[n])


@pytest.mark.parametrize(("A", "omega"), EXACT.items())
def test_v24_by_harmonic_balance(A: float, omega: float) -> None:
    """Odd harmonics up to 11 of the hardest orbit (A = 2) fall by 0.045 each: converged to the printed digits."""
    assert conservative_frequency(0.0, A, 11) == pytest.approx(omega, abs=6e-8)


@pytest.mark.parametrize(("A", "omega"), [(0.05, 0.9998960), (0.1, 0.9996178)])
def test_v25_by_harmonic_balance(A: float, omega: float) -> None:
    assert conservative_frequency(1.0, A, 6) == pytest.approx(omega, abs=6e-8)
