"""Backbone and damping against the polar normal form."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.backbone import backbone, normal_motion
from romgen.errors import InputError
from tests.normal_form_models import averaged_oscillator, damped_oscillator, published_order7, resonant_pair

GAMMA = -0.03 + 0.4j
MODEL = averaged_oscillator(GAMMA, damping=0.02)


def test_cubic_normal_form() -> None:
    """rho'/rho = Re lambda + Re gamma rho^2, theta' = Im lambda + Im gamma rho^2; x = 2 rho cos."""
    curve = backbone(MODEL)
    theta = np.sqrt(1.0 - 1e-4) + 0.4 * curve.rho**2
    np.testing.assert_allclose(curve.frequency_hz, theta / (2.0 * np.pi), rtol=1e-13)
    np.testing.assert_allclose(curve.damping_ratio, (0.01 + 0.03 * curve.rho**2) / theta, rtol=1e-12)
    np.testing.assert_allclose(curve.amplitude_sqrt2_rms[:, 0], 2.0 * curve.rho, rtol=1e-13)
    np.testing.assert_allclose(curve.amplitude_max[:, 0], 2.0 * curve.rho, rtol=1e-6)


def test_range_is_the_trained_one_and_beyond_is_flagged() -> None:
    assert backbone(MODEL).rho[-1] == pytest.approx(2.0)
    assert not backbone(MODEL).exceeds_trained_range.any()
    np.testing.assert_array_equal(backbone(MODEL, rho=np.array([1.9, 2.1])).exceeds_trained_range, [False, True])


def test_non_resonant_terms_are_named() -> None:
    assert backbone(damped_oscillator(0.1, cubic=1.0)).notes == (
        "3 non-resonant terms of the normal form do not enter the backbone",
    )


def test_locked_branch_satisfies_the_polar_equations() -> None:
    """rho2' = 0 and theta2' = 2 theta1', written with the printed coupling terms only."""
    model = resonant_pair(0.1, 0.01)
    curve = backbone(model, slaved=True, rho=np.linspace(0.01, 0.15, 8))
    z1, z2 = curve.q.T
    turn = (model.eigenvalues[0] + 0.1j * z1.conj() * z2 / z1).imag
    np.testing.assert_allclose(model.eigenvalues[1] * z2 + 0.025j * z1**2, 2j * turn * z2, atol=1e-12)
    np.testing.assert_allclose(curve.frequency_hz, turn / (2.0 * np.pi), rtol=1e-12)
    assert np.all(np.abs(z2) > 0.0)


def test_second_mode_alone() -> None:
    curve = backbone(published_order7(), mode=1)
    assert not curve.q[:, 0].any()
    # TRC.md: zeta2 = 0.135 % at rho2 = 0.30
    assert 100.0 * curve.damping_ratio[-1] == pytest.approx(0.135, abs=5e-4)


def test_motion_of_the_first_mode() -> None:
    q, rate = normal_motion(MODEL, 0, False, np.array([1.0]))
    assert q[0, 0] == 1.0
    assert rate[0] == pytest.approx(complex(-0.01, np.sqrt(1.0 - 1e-4)) + GAMMA)


def test_requests_that_make_no_sense() -> None:
    with pytest.raises(InputError, match="no such mode"):
        backbone(MODEL, mode=1)
    with pytest.raises(InputError, match="positive and ascending"):
        backbone(MODEL, rho=np.array([0.0, 1.0]))
    with pytest.raises(InputError, match="cannot lock"):
        backbone(published_order7(), mode=1, slaved=True)
