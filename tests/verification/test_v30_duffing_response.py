"""V30: frequency response of x'' + 0.1 x' + x + 0.04 x^3 = cos(Omega t), written exactly as a reduced model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from romgen.branch import Branch, ContinuationSettings
from romgen.continuation import continue_branch
from romgen.forced_response import forced_response
from romgen.forcing import harmonic_load
from romgen.periodic_orbit import HarmonicBalance, harmonic_balance
from romgen.settings import ForcedResponseSettings
from tests.normal_form_models import damped_oscillator

MODEL = damped_oscillator(0.1, cubic=0.04)
SETTINGS = ContinuationSettings((0.8, 1.8), state_scale=3.0, parameter_scale=0.1)


@lru_cache
def response(harmonics: int) -> tuple[HarmonicBalance, Branch]:
    balance = harmonic_balance(MODEL, harmonic_load(MODEL, "load", 1.0), 0, harmonics)
    start = balance.start(balance.linear_response(0.8), 0.8)
    return balance, continue_branch(balance, start, 0.8, SETTINGS)


def first_harmonic(balance: HarmonicBalance, branch: Branch) -> tuple[float, float]:
    """Peak of abs(X_1) of x = z + conj z and its Omega, by a parabola through the highest three points."""
    H = balance.harmonics
    c = branch.x.reshape(len(branch.x), 2, -1)
    z = c[:, 0] + 1j * c[:, 1]
    amplitude = 2.0 * np.abs(z[:, H + 1] + z[:, H - 1].conj())
    rows = np.argmax(amplitude) + np.array([-1, 0, 1])
    # near the peak the amplitude is a parabola of the position along the branch, here of the phase
    phase = np.angle(z[rows, H + 1] + z[rows, H - 1].conj())
    fit = np.polyfit(phase, amplitude[rows], 2)
    top = -fit[1] / (2.0 * fit[0])
    return float(np.polyval(fit, top)), float(np.polyval(np.polyfit(phase, branch.p[rows], 2), top))


def test_folds() -> None:
    """Eleven harmonics (six odd ones) as in the reference; a load of F instead of F/2 would move both folds by 10 %."""
    _, branch = response(11)
    upper, lower = (fold.p for fold in branch.located("fold"))
    assert lower == pytest.approx(1.2520150, abs=1e-6)
    assert upper == pytest.approx(1.5224480, abs=1e-6)


def test_single_harmonic() -> None:
    balance, branch = response(1)
    upper, lower = (fold.p for fold in branch.located("fold"))
    assert lower == pytest.approx(1.2515913, abs=1e-6)
    assert upper == pytest.approx(1.5184255, abs=1e-6)
    assert first_harmonic(balance, branch)[0] == pytest.approx(6.5921, abs=1e-4)


def test_peak() -> None:
    amplitude, omega = first_harmonic(*response(11))
    assert amplitude == pytest.approx(6.53827, abs=2e-5)
    assert omega == pytest.approx(1.52024, abs=2e-5)


def test_only_the_middle_branch_is_unstable() -> None:
    _, branch = response(11)
    first, second = (fold.index for fold in branch.located("fold"))
    assert branch.stable[:first].all()
    assert not branch.stable[first + 1 : second].any()
    assert branch.stable[second + 1 :].all()


def test_complete_stage() -> None:
    settings = ForcedResponseSettings(
        input="load", levels=(1.0,), measure="max", frequency_range_hz=(0.8 / 2 / np.pi, 1.8 / 2 / np.pi)
    )
    (curve,) = forced_response(MODEL, settings).curves
    np.testing.assert_allclose(2.0 * np.pi * np.sort(curve.folds_hz), [1.2520150, 1.5224480], atol=1e-5)
    # V30: peak of abs(x) 6.70368 at the peak of the first harmonic; the largest one is read along the curve
    assert curve.peak_m == pytest.approx(6.7045, abs=2e-3)
