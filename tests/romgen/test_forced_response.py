"""The forced response as a whole: records, ranges, notes, further branches, failures."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import h5py
import numpy as np
import pytest

from romgen.errors import InputError
from romgen.forced_curve import ForcedResponse
from romgen.forced_response import forced_response
from romgen.polynomial import PolynomialMap
from romgen.settings import ForcedResponseSettings
from romgen.store import read_record, write_record
from tests.normal_form_models import averaged_oscillator, damped_oscillator, linear_charts, published_order7
from tests.records import same

TWO_PI = 2.0 * np.pi


def test_linear_oscillator_has_the_transfer_function() -> None:
    """x'' + c x' + x = F cos: amplitude F / abs(1 - Omega^2 + i c Omega), phase resonance at Omega = 1."""
    model = damped_oscillator(0.02)
    response = forced_response(model, ForcedResponseSettings(input="load", levels=(0.03,)))
    (curve,) = response.curves
    omega = TWO_PI * curve.frequency_hz
    exact = 0.03 / np.abs(1.0 - omega**2 + 0.02j * omega)
    assert response.route == "rotating_frame"
    np.testing.assert_allclose(curve.amplitude_sqrt2_rms[:, 0], exact, rtol=1e-9)
    np.testing.assert_allclose(curve.amplitude_max[:, 0], exact, rtol=1e-6)
    assert curve.stable.all()
    # parabolas through adaptive points (tangents turn by 0.12 rad at most) read the peak to 1e-4
    assert curve.peak_m == pytest.approx(1.5 / np.sqrt(1.0 - 1e-4), rel=1e-4)
    assert TWO_PI * curve.peak_hz == pytest.approx(np.sqrt(1.0 - 2e-4), abs=1e-4)


def test_two_modes_without_internal_resonance_answer_together() -> None:
    """r = (1, 1): the load drives both rows and nothing is left to a correction."""
    eigenvalues = np.array([-0.01 + 1j, -0.01 + 1.3j])
    load = np.array([-0.5j, -0.2j])
    none = PolynomialMap(np.array([[2, 0, 1, 0]]), np.zeros((2, 1), dtype=np.complex128))
    model = linear_charts(eigenvalues, none, load)
    settings = ForcedResponseSettings(input="load", levels=(0.02,), sensor="x2", frequency_range_hz=(0.14, 0.23))
    (curve,) = forced_response(model, settings).curves
    s = 2j * np.pi * curve.frequency_hz[:, None]
    exact = 0.02 * np.abs(load / (s - eigenvalues) + load.conj() / (s - eigenvalues.conj()))
    np.testing.assert_allclose(curve.amplitude_sqrt2_rms, exact, rtol=1e-9)


def test_damping_along_the_curve_is_that_of_the_normal_form() -> None:
    """-Re(n / q) / Omega with n / q = lambda + gamma abs(q)^2."""
    model = averaged_oscillator(-0.01 + 0.05j, damping=0.02)
    (curve,) = forced_response(model, ForcedResponseSettings(input="load", levels=(0.02,))).curves
    expected = (0.01 + 0.01 * np.abs(curve.q[:, 0]) ** 2) / (TWO_PI * curve.frequency_hz)
    np.testing.assert_allclose(curve.damping_ratio, expected, rtol=1e-9)


def test_phase_resonance_lies_on_the_backbone() -> None:
    model = averaged_oscillator(0.05j, damping=0.02)
    (curve,) = forced_response(model, ForcedResponseSettings(input="load", levels=(0.02,))).curves
    rho = 0.5 * curve.phase_resonance_m[0]
    # linear interpolation between points whose tangents differ by less than 0.12 rad
    assert TWO_PI * curve.phase_resonance_hz[0] == pytest.approx(np.sqrt(1 - 1e-4) + 0.05 * rho**2, abs=1e-3)
    assert rho == pytest.approx(0.5 * 0.01 / 0.01, rel=1e-2)


def test_isola_is_found() -> None:
    """Damping c(rho) = 0.02 - 0.03 rho^2 + 0.0125 rho^4 falls to 0.002 and rises: rho c(rho) = f has three roots.

    The highest two lie on a detached branch: f = 0.0048 is below the local maximum of rho c(rho) (0.0067 at 0.52)
    and above its minimum (0.0022 at 1.08).
    """
    E = np.array([[2, 1], [3, 2]])
    C = np.array([[0.03 + 0.02j, -0.0125]])
    model = linear_charts(np.array([-0.02 + 1j]), PolynomialMap(E, C), np.array([-0.5j]), trained=np.array([2.0]))
    main, isola = forced_response(model, ForcedResponseSettings(input="load", levels=(4 * 0.0048,))).curves
    assert main.ends == ("range", "range")
    assert isola.ends == ("closed", "closed")
    assert isola.branch == 1
    rho = np.abs(isola.q[:, 0])
    roots = np.roots([0.0125, 0.0, -0.03, 0.0, 0.02, -0.0048])
    real = np.sort(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0)].real)
    # on the ridge rho c(rho) = f: the extremes of the isola; points turn by 0.12 rad at most
    assert (rho.min(), rho.max()) == pytest.approx(tuple(real[1:]), rel=5e-3)
    assert np.abs(main.q[:, 0]).max() == pytest.approx(real[0], rel=5e-3)


def test_model_with_other_terms_takes_the_complete_route() -> None:
    model = damped_oscillator(0.1, cubic=0.04)
    response = forced_response(model, ForcedResponseSettings(input="load", levels=(0.3,), measure="max"))
    assert response.route == "periodic_orbit"
    assert any("harmonic balance" in note for note in response.notes)
    assert response.curves[0].amplitude_max.max() == pytest.approx(response.curves[0].peak_m, rel=1e-3)


def test_points_beyond_training_are_flagged_and_the_branch_is_cut() -> None:
    model = dataclasses.replace(averaged_oscillator(0.05j, damping=0.02), trained_amplitude=np.array([0.2]))
    response = forced_response(model, ForcedResponseSettings(input="load", levels=(0.02,)))
    main = response.curves[0]
    np.testing.assert_array_equal(main.exceeds_trained_range, np.abs(main.q[:, 0]) > 0.2)
    assert main.exceeds_trained_range.any()
    assert "limit" in main.ends
    assert any("outside the trained range" in note for note in response.notes)
    assert any("limit" in note for note in response.notes)
    # the far side of the resonance is reached from the other end of the range
    assert len(response.curves) == 2
    assert np.ptp(np.concatenate([c.frequency_hz[[0, -1]] for c in response.curves])) == pytest.approx(
        np.ptp(response.frequency_range_hz)
    )


def test_record_round_trip(tmp_path: Path) -> None:
    response = forced_response(published_order7(0.4), ForcedResponseSettings(input="load", levels=(1.0,)))
    with h5py.File(tmp_path / "response.h5", "w") as file:
        write_record(file.create_group("forced_response"), response)
    with h5py.File(tmp_path / "response.h5") as file:
        assert same(read_record(file["forced_response"], ForcedResponse), response)


def test_requested_range_is_kept_to_its_ends() -> None:
    settings = ForcedResponseSettings(input="load", levels=(1.0,), frequency_range_hz=(105.0, 115.0))
    (curve,) = forced_response(published_order7(0.4), settings).curves
    assert sorted(curve.frequency_hz[[0, -1]]) == pytest.approx([105.0, 115.0])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (ForcedResponseSettings(input="load"), "levels must be non-zero"),
        (ForcedResponseSettings(input="load", levels=(1.0, 0.0)), "levels must be non-zero"),
        (ForcedResponseSettings(input="shaker", levels=(1.0,)), "unknown load input"),
        (ForcedResponseSettings(input="load", levels=(1.0,), sensor="tip"), "unknown sensor"),
        (
            ForcedResponseSettings(input="load", levels=(1.0,), frequency_range_hz=(190.0, 200.0)),
            "does not drive this mode",
        ),
    ],
)
def test_requests_that_make_no_sense(settings: ForcedResponseSettings, message: str) -> None:
    with pytest.raises(InputError, match=message):
        forced_response(published_order7(0.4), settings)
