"""The chart of noisy sensors: second differences fail, delay windows find the modes."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import NumericalError
from romgen.learning_notes import _chart_notes
from romgen.sensor_modes import learn_sensor_chart
from romgen.trajectory import Trajectory

HERTZ, RATIO, STEP, DURATION = np.array([110.0, 221.0]), np.array([0.004, 0.005]), 2e-4, 0.6
SHAPES = np.array([[0.8, -0.5], [1.0, 0.1], [0.7, 0.6]])


def decays(noise: float, growth: float = -1.0) -> list[Trajectory]:
    """Two free decays in closed form, noise as a share of the first amplitude, white."""
    rng, t = np.random.default_rng(4), STEP * np.arange(round(DURATION / STEP))
    rates = 2.0 * np.pi * HERTZ * (growth * RATIO + 1j)
    motions = []
    for name, amplitudes in (("one", (1.0, 0.2)), ("two", (0.3, 0.5))):
        x = 1e-3 * (np.array(amplitudes) * np.exp(np.outer(t, rates))).real @ SHAPES.T
        motions.append(Trajectory(name, t, ("a", "b", "c"), x + 1e-3 * noise * rng.standard_normal(x.shape)))
    return motions


@pytest.mark.parametrize(("noise", "delays"), [(0.0, False), (0.01, True), (0.05, True)])
def test_noise_is_averaged_by_windows(noise: float, delays: bool) -> None:
    """Frequencies to a tenth of the resolution 1 / T of the record."""
    motions = decays(noise)
    chart = learn_sensor_chart(motions, 2)
    assert (chart.delays > 1) == delays
    np.testing.assert_allclose(chart.frequency_hz, HERTZ, atol=0.1 / DURATION, rtol=0.0)
    assert any("too noisy for 2 modes" in note for note in _chart_notes(motions, chart)) == delays


def test_coarse_sampling_is_noted() -> None:
    """4 ms alias both modes; 1 ms leaves 4.5 samples in a period of the second."""
    for stride, few in ((1, False), (5, True), (20, True)):
        motions = [Trajectory(m.name, m.t[::stride], m.sensors, m.displacement[::stride]) for m in decays(0.0)]
        notes = list(_chart_notes(motions, learn_sensor_chart(motions, 2)))
        assert any("samples in a period" in note for note in notes) == few


def test_growing_motions_are_still_refused() -> None:
    with pytest.raises(NumericalError, match="not that of decaying oscillations"):
        learn_sensor_chart(decays(0.0, growth=0.5), 2)
