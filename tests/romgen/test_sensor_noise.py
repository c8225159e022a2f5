"""The chart of noisy sensors: what sampling they have must not matter, and what they cannot show is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from romgen.chart import sensor_chart
from romgen.errors import InputError, NumericalError
from romgen.learn import learn
from romgen.learning_notes import _chart_notes
from romgen.low_pass import RIPPLE_DB, SMOOTHED, STOP, low_pass, smoothed
from romgen.noise_floor import acceleration_noise, line_spectrum, separate_lines, signal_end_hz
from romgen.sensor_modes import _Held, learn_sensor_chart
from romgen.settings import LearnSettings
from romgen.trajectory import Trajectory

HERTZ, RATIO, STEP, DURATION = np.array([110.0, 221.0]), np.array([0.004, 0.005]), 2e-4, 0.6
SHAPES = np.array([[0.8, -0.5], [1.0, 0.1], [0.7, 0.6]])
STARTS = {"one": (1.0, 0.2), "two": (0.3, 0.5), "other": (0.7, 0.4)}


def decays(
    noise: float, growth: float = -1.0, step: float = STEP, names: tuple[str, ...] = ("one", "two")
) -> list[Trajectory]:
    """Free decays in closed form, noise as a share of the first amplitude, white."""
    rng, t = np.random.default_rng(4), step * np.arange(round(DURATION / step))
    rates = 2.0 * np.pi * HERTZ * (growth * RATIO + 1j)
    motions = []
    for name in names:
        x = 1e-3 * (np.array(STARTS[name]) * np.exp(np.outer(t, rates))).real @ SHAPES.T
        motions.append(Trajectory(name, t, ("a", "b", "c"), x + 1e-3 * noise * rng.standard_normal(x.shape)))
    return motions


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.02])
@pytest.mark.parametrize("step", [4e-4, 1e-4, 2e-5])
def test_frequencies_do_not_depend_on_the_sampling(noise: float, step: float) -> None:
    """Without noise the differences decide; with it the resolution 1 / T of the record, at every sampling.

    At 20 kHz and 1 % the noise of second differences is thirty times their signal.
    """
    motions = decays(noise, step=step)
    chart = learn_sensor_chart(motions, 2)
    tolerance = 1.0 / DURATION if noise else 0.01 / DURATION
    np.testing.assert_allclose(chart.frequency_hz, HERTZ, atol=tolerance, rtol=0.0)
    assert (chart.low_pass is not None) == (noise > 0.0)
    assert chart.doubt == ""
    assert any("the sensors carry noise of" in note for note in _chart_notes(motions, chart)) == (noise > 0.0)


@pytest.mark.parametrize("step", [4e-4, 5e-5])
def test_held_out_errors_are_those_of_the_noise(step: float) -> None:
    """NMTE against the recorded samples is at least 100 E|n| / max |x|, n the noise of three sensors: 1.6 s."""
    noise, settings = 0.02, LearnSettings(internal_resonance=(), order=3)
    *training, held_out = decays(noise, step=step, names=("one", "two", "other"))
    error = learn(training, [held_out], settings, "noisy").validation[0]
    # mean of the norm of three standard normal numbers: sqrt(8 / pi)
    floor = 100.0 * 1e-3 * noise * np.sqrt(8.0 / np.pi) / np.linalg.norm(held_out.displacement, axis=1).max()
    assert 0.95 * floor < error.nmte_percent < 1.5 * floor


def test_decimals_of_a_file_do_not_matter() -> None:
    """Six digits, as in CSV, are noise of 1e-6 of the motion, which differences at 20 kHz enlarge to 0.4 %.

    The same motions in full give the same frequencies to the bias of what the low-pass leaves, below 1e-6 of them.
    """
    full = decays(0.0, step=5e-5)
    rounded = [replace(m, displacement=np.vectorize(lambda v: float(f"{v:.6g}"))(m.displacement)) for m in full]
    charts = [learn_sensor_chart(motions, 2) for motions in (full, rounded)]
    assert [chart.low_pass is None for chart in charts] == [True, False]
    np.testing.assert_allclose(charts[1].frequency_hz, charts[0].frequency_hz, rtol=1e-6)


def test_the_noise_is_measured() -> None:
    """Variance over three sensors to 3 %: five standard deviations of a median over 9000 powers."""
    motions = decays(0.01, step=1e-4)
    spectrum = line_spectrum([m.displacement for m in motions], 1e-4)
    assert spectrum.noise == pytest.approx(3 * (1e-3 * 0.01) ** 2, rel=0.03)
    np.testing.assert_allclose(separate_lines(spectrum, 0.02), HERTZ, atol=spectrum.resolution_hz)
    assert HERTZ[-1] <= signal_end_hz(spectrum) < HERTZ[-1] + 4.0 * spectrum.resolution_hz
    u_ddot = np.vstack([1e-3 * (2 * np.pi * HERTZ) ** 2 * np.array(STARTS[m.name]) for m in motions])
    largest = np.linalg.norm(u_ddot @ SHAPES.T, axis=1).max()
    assert 1e-3 * 0.01 / 1e-4**2 / largest < acceleration_noise(spectrum, 1e-4)


def test_the_low_pass_passes_and_stops_what_it_says() -> None:
    step = 2e-5
    motions = decays(0.01, step=step)
    spectrum = line_spectrum([m.displacement for m in motions], step)
    found = low_pass(spectrum, step, 1e-3)
    assert found is not None
    k = np.arange(len(found.taps)) - len(found.taps) // 2
    ripple = 10.0 ** (-RIPPLE_DB / 20.0)
    for f in np.linspace(0.0, found.pass_hz, 20):
        assert found.taps @ np.cos(2 * np.pi * f * step * k) == pytest.approx(1.0, abs=2 * ripple)
    for f in np.linspace(STOP * found.pass_hz, 0.5 / step, 200):
        assert abs(found.taps @ np.cos(2 * np.pi * f * step * k)) < 2 * ripple
    t = motions[0].t
    wave = np.sin(2 * np.pi * 0.9 * found.pass_hz * t)[:, None]
    kept, recorded, smooth = smoothed(found, t, wave, "wave")
    np.testing.assert_allclose(smooth, recorded, atol=2 * ripple)
    assert np.array_equal(recorded[:, 0], wave[np.isin(t, kept), 0])
    assert 10.0 <= 1.0 / (found.pass_hz * step * found.stride) < 20.0


def test_clean_motions_stay_as_they_are() -> None:
    motions = decays(0.0, step=5e-5)
    spectrum = line_spectrum([m.displacement for m in motions], 5e-5)
    assert acceleration_noise(spectrum, 5e-5) < 0.01 * SMOOTHED
    chart = learn_sensor_chart(motions, 2)
    assert chart.low_pass is None
    assert np.array_equal(sensor_chart(chart, motions[0]).displacement, motions[0].displacement[4:-4])


@pytest.mark.parametrize("step", [1e-3, 1e-4, 2e-5])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.02])
def test_one_mode_is_not_two(step: float, noise: float) -> None:
    """One shape and one line, whatever a second mode could be made of: harmonics, rounding or noise."""
    t = step * np.arange(round(DURATION / step))
    x = 1e-3 * (np.exp(-3.0 * t) * np.cos(2 * np.pi * 110.0 * t))[:, None] * SHAPES[:, 0]
    x = x + 1e-3 * noise * np.random.default_rng(2).standard_normal(x.shape)
    motion = Trajectory("lone", t, ("a", "b", "c"), x)
    with pytest.raises(NumericalError, match="2 master modes are asked for, but the data hold one mode") as caught:
        learn_sensor_chart([motion], 2)
    assert "set [learn] master_modes to [1]" in str(caught.value)
    assert learn_sensor_chart([motion], 1).frequency_hz == pytest.approx([110.0], abs=1.0 / DURATION)


def test_a_chart_that_the_spectrum_contradicts_is_noted() -> None:
    motions = decays(0.0)
    chart = replace(learn_sensor_chart(motions, 2), frequency_hz=np.array([150.0, 221.0]))
    held = _Held(line_spectrum([m.displacement for m in motions], STEP), 2)
    assert held.doubt(replace(chart, frequency_hz=HERTZ)) == ""
    doubtful = replace(chart, doubt=held.doubt(chart))
    assert "has modes at 150, 221 Hz, the spectrum has lines at 109.9, 219.8 Hz" in doubtful.doubt
    assert any("the chart may be wrong" in note for note in _chart_notes(motions, doubtful))


def test_the_number_of_samples_needed_is_enough() -> None:
    """One sensor needs delay windows of two periods; the number in the message is the least that works."""
    (motion, *_) = (Trajectory(m.name, m.t, ("a",), m.displacement[:, :1]) for m in decays(0.0))
    with pytest.raises(InputError, match="shorter than a delay window; got 60 samples; at least") as caught:
        learn_sensor_chart([replace(motion, t=motion.t[:60], displacement=motion.displacement[:60])], 2)
    needed = int(caught.value.advice.split()[2])
    assert 60 < needed < 200


@pytest.mark.parametrize("n", [2, 7, 9, 30])
def test_records_of_a_few_samples_are_refused_in_one_line(n: int) -> None:
    (motion, _) = decays(0.01)
    with pytest.raises((InputError, NumericalError), match=r"sensor chart|differences"):
        learn_sensor_chart([replace(motion, t=motion.t[:n], displacement=motion.displacement[:n])], 2)


def test_a_record_too_short_for_a_chart_is_refused() -> None:
    motions = decays(0.02, step=2e-5)
    chart = learn_sensor_chart(motions, 2)
    assert chart.low_pass is not None
    short = replace(motions[0], t=motions[0].t[:500], displacement=motions[0].displacement[:500])
    with pytest.raises(InputError, match=f"got 500 samples; at least {len(chart.low_pass.taps)} samples are needed"):
        sensor_chart(chart, short)
    n = len(chart.low_pass.taps) + chart.low_pass.stride
    short = replace(motions[0], t=motions[0].t[:n], displacement=motions[0].displacement[:n])
    with pytest.raises(InputError, match="too short for windows and derivatives"):
        sensor_chart(chart, short)


def test_coarse_sampling_is_noted() -> None:
    """4 ms alias both modes; 1 ms leaves 4.5 samples in a period of the second."""
    for stride, few in ((1, False), (5, True), (20, True)):
        motions = [Trajectory(m.name, m.t[::stride], m.sensors, m.displacement[::stride]) for m in decays(0.0)]
        notes = list(_chart_notes(motions, learn_sensor_chart(motions, 2)))
        assert any("samples in a period" in note for note in notes) == few


def test_growing_motions_are_still_refused() -> None:
    with pytest.raises(NumericalError, match="not that of decaying oscillations"):
        learn_sensor_chart(decays(0.0, growth=0.5), 2)
