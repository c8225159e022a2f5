"""V29: the 1:2 system, conservative energy exchange and forced saturation (Nayfeh, Mook)."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.forced_curve import ForcedCurve
from romgen.forced_response import forced_response
from romgen.settings import ForcedResponseSettings
from romgen.simulate import simulate
from tests.normal_form_models import resonant_pair

A, ZETA = 0.1, 0.01
DRIVE_HZ = 2.0 / (2.0 * np.pi)
# F above which the directly driven mode loses stability at Omega = 2 omega_1.
CRITICAL = 0.016


def test_conservative_energy_exchange() -> None:
    """A1 = A10 sech(Gamma t), A2 = A10/2 tanh(Gamma t), Gamma = a A10 / 4 omega_1: exact for the averages."""
    a, A10 = 0.02, 0.2
    model = resonant_pair(a, 0.0)
    rate = a * A10 / 4.0
    t = np.linspace(0.0, 3.0 / rate, 301)
    # the sech solution is the separatrix that starts with all energy in mode 1; phases as in i (a / 4) z1^2
    z = simulate(model, t, np.array([0.5 * A10 + 0j, 0j]), max_step=0.05)
    np.testing.assert_allclose(2.0 * np.abs(z[:, 0]), A10 / np.cosh(rate * t), atol=1e-5 * A10)
    np.testing.assert_allclose(2.0 * np.abs(z[:, 1]), 0.5 * A10 * np.tanh(rate * t), atol=1e-5 * A10)


def curves_at(level: float) -> tuple[ForcedCurve, ...]:
    settings = ForcedResponseSettings(
        input="load", levels=(level,), frequency_range_hz=(0.95 * DRIVE_HZ, 1.05 * DRIVE_HZ)
    )
    return forced_response(resonant_pair(A, ZETA), settings).curves


def amplitudes(curve: ForcedCurve) -> list[tuple[float, float, bool]]:
    """(A1, A2, stable) at Omega = 2 omega_1, wherever the curve passes it."""
    above = curve.frequency_hz - DRIVE_HZ
    rows = np.flatnonzero(above[:-1] * above[1:] <= 0.0)
    found = []
    for i in rows:
        share = above[i] / (above[i] - above[i + 1])
        q = 2.0 * np.abs((1.0 - share) * curve.q[i] + share * curve.q[i + 1])
        found.append((float(q[0]), float(q[1]), bool(curve.stable[i])))
    return found


@pytest.mark.parametrize(("level", "a1"), [(0.02, 0.283), (0.03, 0.529), (0.04, 0.693)])
def test_saturation(level: float, a1: float) -> None:
    """Above the critical load the driven mode stays at A2 = 2 zeta omega_1^2 / a = 0.2, the excess goes to mode 1."""
    direct, *others = curves_at(level)
    assert others, "the subharmonic branch was not found"
    stable = [point for curve in others for point in amplitudes(curve) if point[2]]
    assert stable
    for point in stable:
        assert point[0] == pytest.approx(a1, rel=1e-2)
        assert point[1] == pytest.approx(2.0 * ZETA / A, rel=1e-2)
    (linear,) = amplitudes(direct)
    assert not linear[2]
    assert linear[1] == pytest.approx(level / (2.0 * ZETA * 4.0), rel=1e-2)


def test_linear_below_the_critical_load() -> None:
    (direct,) = curves_at(0.01)
    (point,) = amplitudes(direct)
    assert point[0] == pytest.approx(0.0, abs=1e-12)
    assert point[1] == pytest.approx(0.125, rel=1e-2)
    assert point[2]
    assert direct.branch_point_hz.size == 0


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_critical_load(factor: float) -> None:
    """The direct response loses stability at its peak just above F = 8 zeta^2 omega_1^2 / a * 2 = 0.016."""
    direct = curves_at(factor * CRITICAL)[0]
    assert (direct.branch_point_hz.size == 2) == (factor > 1.0)
