"""Coefficients and discrete frequency against a marched oscillator."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.generalized_alpha import Scheme


def march(scheme: Scheme, omega: float, h: float, count: int, zeta: float = 0.0) -> np.ndarray:
    """Free decay of x'' + 2 zeta omega x' + omega^2 x = 0 from x = 1 at rest, by the two balance equations by hand."""
    am, af, b, g = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma
    k, c = omega**2, 2.0 * zeta * omega
    u, v, a = 1.0, 0.0, -k
    result = [u]
    for _ in range(count):
        u0, v0 = u + h * v + h * h * (0.5 - b) * a, v + h * (1.0 - g) * a
        known = am * a + c * ((1.0 - af) * v0 + af * v) + k * ((1.0 - af) * u0 + af * u)
        a = -known / ((1.0 - am) + (1.0 - af) * (c * h * g + k * h * h * b))
        u, v = u0 + h * h * b * a, v0 + h * g * a
        result.append(u)
    return np.array(result)


def _frequency(x: np.ndarray, h: float) -> float:
    """Angular frequency by the exact recurrence of a sampled (decaying) sinusoid: x_(n+1) + d x_(n-1) = 2 c x_n."""
    coefficients = np.linalg.lstsq(np.column_stack([x[1:-1], x[:-2]]), x[2:], rcond=None)[0]
    return float(np.abs(np.angle(np.roots([1.0, -coefficients[0], -coefficients[1]])[0])) / h)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9, 1.0])
def test_discrete_frequency_is_that_of_a_marched_oscillator(rho: float) -> None:
    scheme, omega, h = Scheme.from_radius(rho), 700.0, 5e-4
    # The first samples hold the fast decaying third root of the scheme as well.
    x = march(scheme, omega, h, 400)[60:]
    assert scheme.discrete_frequency(omega, h) == pytest.approx(_frequency(x, h), rel=1e-9)


@pytest.mark.parametrize("rho", [0.5, 0.9, 1.0])
def test_spectral_radius_at_infinity(rho: float) -> None:
    """A mode far above the time step decays by rho per step; coinciding roots add a factor of up to n^2."""
    n = 200
    x = march(Scheme.from_radius(rho), 1e3, 1.0, n)
    assert np.abs(x[-5:]).max() ** (1.0 / n) == pytest.approx(rho, abs=n ** (2.0 / n) - 1.0)


def test_coefficients_are_those_of_chung_and_hulbert() -> None:
    average = Scheme.from_radius(1.0)
    assert (average.alpha_m, average.alpha_f, average.beta, average.gamma) == (0.5, 0.5, 0.25, 0.5)
    scheme = Scheme.from_radius(0.5)
    assert scheme.alpha_m == pytest.approx(0.0)
    assert scheme.alpha_f == pytest.approx(1.0 / 3.0)
    assert scheme.gamma == pytest.approx(5.0 / 6.0)
    assert scheme.beta == pytest.approx(4.0 / 9.0)


@pytest.mark.parametrize("rho", [0.5, 0.9, 1.0])
def test_corrected_inertia_restores_the_frequency(rho: float) -> None:
    scheme, omega, h = Scheme.from_radius(rho), 2.0 * np.pi * 200.0, 1e-4
    ratio = scheme.frequency_corrected_inertia(omega, h)
    corrected = omega / np.sqrt(1.0 + ratio)
    assert scheme.discrete_frequency(corrected, h) == pytest.approx(omega, rel=1e-12)
    # The scheme alone is slow by (omega h)^2/12 for average acceleration, more with numerical damping.
    assert scheme.discrete_frequency(omega, h) < omega * (1.0 - (omega * h) ** 2 / 12.5)


def test_values_out_of_range_are_refused() -> None:
    for rho in (-0.1, 1.1, float("nan")):
        with pytest.raises(FemInputError, match="spectral radius"):
            Scheme.from_radius(rho)
    with pytest.raises(FemInputError, match=r"time step too large .* dispersion_correction=False"):
        Scheme.from_radius(0.9).frequency_corrected_inertia(1e4, 1.1e-4)
