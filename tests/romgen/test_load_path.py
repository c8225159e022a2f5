"""The load that a measured amplitude needs: closed forms, slopes, both routes, folds, and points out of reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.forced_response import forced_response
from romgen.lifted_orbit import Measure
from romgen.load_path import LoadPath, load_path
from romgen.load_system import MeasuredPoint
from romgen.reduced_model import ReducedModel
from romgen.settings import ForcedResponseSettings
from tests.normal_form_models import averaged_oscillator, damped_oscillator, published_order7, resonant_pair

TWO_PI = 2.0 * np.pi
GAMMA, DAMPING = -0.004 - 0.05j, 0.02


def measured(
    model: ReducedModel, amplitude: float, frequency_hz: float | None, mode: int = 0, measure: Measure = "sqrt2_rms"
) -> LoadPath:
    point = MeasuredPoint("point 1", 1.0, frequency_hz, mode, measure, amplitude, mode, frequency_hz is None)
    return load_path(model, model.input_matrix[:, 0], point)


def closed_form(rho: FloatArray, omega: float) -> tuple[FloatArray, FloatArray]:
    """Level and amplitude of z' = lambda z + gamma z^2 conj z - i u / 2.

    abs(f) = rho abs(lambda - i Omega + gamma rho^2). With z = q e^{i phi} + b e^{-i phi}, b = f / (-i Omega - lambda),
    the sensor 2 Re z has the amplitude 2 abs(q + conj(b)).
    """
    model = averaged_oscillator(GAMMA, DAMPING)
    n = model.eigenvalues[0] - 1j * omega + GAMMA * rho**2
    level = 4.0 * rho * np.abs(n)
    f = -0.25j * level
    q = -f / n
    back = f / (-1j * omega - model.eigenvalues[0])
    return level, 2.0 * np.abs(q + back.conj())


@pytest.mark.parametrize("omega", [0.9, 0.94, 1.0, 1.05])
def test_level_of_an_amplitude_has_the_closed_form(omega: float) -> None:
    """Well below 1 the level falls with the amplitude between two folds: every amplitude has one level all the same."""
    model = averaged_oscillator(GAMMA, DAMPING)
    rho = np.linspace(0.1, 1.8, 15)
    level, amplitude = closed_form(rho, omega)
    found = [measured(model, a, omega / TWO_PI).crossing() for a in amplitude]
    # Newton stops at 1e-10 of the scales, the trained amplitude being 20 times the smallest one
    np.testing.assert_allclose([at.level for at in found], level, rtol=1e-8)
    falling = np.array([at.by_amplitude < 0.0 for at in found])
    assert falling.any() == (omega < 0.95)
    # between the folds of the level a single mode is unstable, and only there
    np.testing.assert_array_equal(falling, [not at.stable for at in found])


@pytest.mark.parametrize("omega", [0.94, 1.02])
def test_slopes_are_those_of_the_solutions(omega: float) -> None:
    """Central differences over 2e-4: their error is of the order 1e-8 times the third derivative."""
    model = averaged_oscillator(GAMMA, DAMPING)
    h = 1e-4

    def log_level(a: float, w: float) -> float:
        return float(np.log(measured(model, a, w / TWO_PI).crossing().level))

    at = measured(model, 0.9, omega / TWO_PI).crossing()
    by_amplitude = (log_level(0.9 * np.exp(h), omega) - log_level(0.9 * np.exp(-h), omega)) / (2.0 * h)
    by_frequency = (log_level(0.9, omega * np.exp(h)) - log_level(0.9, omega * np.exp(-h))) / (2.0 * h)
    assert at.by_amplitude == pytest.approx(by_amplitude, rel=1e-4)
    assert at.by_frequency == pytest.approx(by_frequency, rel=1e-4)


def test_peak_needs_the_damping_force() -> None:
    """In phase resonance abs(f) = -Re(lambda + gamma rho^2) rho and Omega = Im(lambda + gamma rho^2)."""
    model = averaged_oscillator(GAMMA, DAMPING)
    for rho in (0.05, 0.5, 1.5):
        n = model.eigenvalues[0] + GAMMA * rho**2
        # the other half of the load adds abs(f) / 2 to q at a right angle: 1e-4 of the amplitude
        at = measured(model, 2.0 * rho, None).crossing()
        assert at.level == pytest.approx(-4.0 * n.real * rho, rel=2e-4)
        assert TWO_PI * at.frequency_hz == pytest.approx(n.imag, rel=2e-5)
        assert at.by_frequency == 0.0


def test_peak_is_that_of_the_frequency_response() -> None:
    """Peak of the resonant order-7 form, torsion locked to it, against phase resonance: the parabola reads to 1e-4."""
    model = published_order7(0.4)
    settings = ForcedResponseSettings(input="load", levels=(2.0,), frequency_range_hz=(102.0, 114.0))
    curve = forced_response(model, settings).curves[0]
    at = measured(model, curve.peak_m, None).crossing()
    assert at.level == pytest.approx(2.0, rel=2e-4)
    assert at.frequency_hz == pytest.approx(curve.peak_hz, abs=0.01)


@pytest.mark.parametrize("frequency_hz", [None, 0.96 / TWO_PI])
@pytest.mark.parametrize("quadratic", [0.0, 0.1])
def test_jacobian_of_the_load_system(frequency_hz: float | None, quadratic: float) -> None:
    """Both conditions, rotating frame and harmonic balance: the residual is a polynomial, differences err by 1e-7."""
    model = damped_oscillator(0.02, quadratic, -0.05) if quadratic else averaged_oscillator(GAMMA, DAMPING)
    path = measured(model, 0.8, frequency_hz)
    x, p, h = path.branch.x[-1] + 1e-2, 0.7 * path.branch.p[-1], 1e-6
    _, J, J_p = path.system.linearise(x, p)
    F = [[path.system.linearise(x + s * h * e, p)[0] for e in np.eye(x.size)] for s in (1, -1)]
    numeric = (np.array(F[0]) - np.array(F[1])) / (2.0 * h)
    np.testing.assert_allclose(J, numeric.T, atol=1e-7 * np.abs(J).max())
    slope = (path.system.linearise(x, p + h)[0] - path.system.linearise(x, p - h)[0]) / (2 * h)
    np.testing.assert_allclose(J_p, slope, atol=1e-8)


@pytest.mark.parametrize("measure", ["max", "sqrt2_rms"])
def test_orbit_at_the_level_has_the_amplitude(measure: Measure) -> None:
    """Harmonic balance of an oscillator with a quadratic term: the two measures differ, each gives its own level."""
    model = damped_oscillator(0.02, 0.3, 0.1)
    path = measured(model, 0.6, 0.97 / TWO_PI, measure=measure)
    at = path.crossing()
    again = replace(path, point=replace(path.point, level=at.level))
    # the orbit is solved to 1e-9 at the fixed level
    assert again.amplitude_at_level() == pytest.approx(0.6, rel=1e-7)
    other = measured(model, 0.6, 0.97 / TWO_PI, measure="max" if measure == "sqrt2_rms" else "sqrt2_rms").crossing()
    assert abs(other.level / at.level - 1.0) > 1e-3


def test_level_that_the_branch_does_not_pass_has_no_amplitude() -> None:
    path = measured(averaged_oscillator(GAMMA, DAMPING), 0.5, 1.0 / TWO_PI)
    assert np.isnan(replace(path, point=replace(path.point, level=1e6)).amplitude_at_level())


def test_input_acts_as_at_rest_where_the_chart_is_linear() -> None:
    """x = z + conj z and x' = lambda z + c.c. exactly: a force changes x'' by as much everywhere."""
    model = damped_oscillator(0.02, 0.3, 0.1)
    assert measured(model, 0.6, 0.97 / TWO_PI).crossing().input_change == pytest.approx(0.0, abs=1e-12)


def test_second_mode_is_followed_from_rest() -> None:
    """Below the threshold of the 1:2 resonance only the second mode answers: linear, level 8 omega zeta 2 omega rho."""
    model = resonant_pair(0.1, 0.01)
    load: ComplexArray = model.input_matrix[:, 0]
    rho = 0.01
    at = measured(model, 2.0 * rho, None, mode=1).crossing()
    assert at.level == pytest.approx(2.0 * abs(model.eigenvalues[1].real) * rho / abs(load[1]), rel=2e-4)


def test_out_of_reach_names_the_point_and_what_is_reached() -> None:
    model = averaged_oscillator(GAMMA, DAMPING)
    with pytest.raises(InputError, match=r"point 1: the model does not reach.*8000 mm, the model goes up to 466"):
        measured(model, 8.0, 1.0 / TWO_PI).crossing()


def test_load_that_drives_another_mode_and_blind_sensor() -> None:
    model = resonant_pair(0.1, 0.01)
    with pytest.raises(InputError, match="does not drive the mode"):
        measured(model, 0.1, None, mode=0)
    point = MeasuredPoint("point 1", 1.0, None, 0, "sqrt2_rms", 0.1, 1, True)
    with pytest.raises(InputError, match="the sensor does not see the driven mode; got x1"):
        load_path(model, model.input_matrix[:, 0], point)
