"""Amplitude measures of orbits whose displacement is known."""

from __future__ import annotations

import dataclasses

import numpy as np

from romgen.lifted_orbit import SAMPLES, orbit_amplitudes, sensor_orbits
from romgen.polynomial import PolynomialMap
from tests.normal_form_models import averaged_oscillator

PHASE = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
# x = w + 0.3 w^2 with w = 2 Re z = A cos(phase + shift): mean 0.15 A^2, harmonics A and 0.15 A^2
MODEL = dataclasses.replace(
    averaged_oscillator(0j), displacement=PolynomialMap(np.array([[1, 0], [2, 0]]), np.array([[1.0, 0.3]]))
)
A = np.array([0.2, 1.0])
ORBITS = (0.5 * A[:, None] * np.exp(1j * (PHASE + 0.017)))[:, :, None]


def test_sensor_orbit() -> None:
    w = A[:, None] * np.cos(PHASE + 0.017)
    np.testing.assert_allclose(sensor_orbits(MODEL, ORBITS)[:, :, 0], w + 0.3 * w**2, atol=1e-15)


def test_measures() -> None:
    amplitudes = orbit_amplitudes(MODEL, ORBITS)
    # the parabola leaves the fourth order of half a sample: (pi / 128)^4 / 24 of the curvature terms
    np.testing.assert_allclose(amplitudes.max[:, 0], A + 0.3 * A**2, rtol=1e-6)
    np.testing.assert_allclose(amplitudes.mean[:, 0], 0.15 * A**2, rtol=1e-12)
    rms_about_mean = np.sqrt(amplitudes.sqrt2_rms[:, 0] ** 2 - 2.0 * amplitudes.mean[:, 0] ** 2)
    np.testing.assert_allclose(rms_about_mean, np.sqrt(A**2 + (0.15 * A**2) ** 2), rtol=1e-12)


def test_blocks_do_not_change_the_result() -> None:
    many = np.repeat(ORBITS, 80, axis=0)
    np.testing.assert_array_equal(orbit_amplitudes(MODEL, many).max[[0, -1]], orbit_amplitudes(MODEL, ORBITS).max)
