"""Short-time spectra against signals with known frequency and amplitude."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.spectrogram import ridge_hz, spectrogram, uniform_samples

T = np.arange(0.0, 2.0, 2e-4)


def test_steady_cosine_shows_its_amplitude_at_its_frequency() -> None:
    """A cos(2 pi f t) with f on a bin gives A at f in every window."""
    spectra = spectrogram(T, 0.7 * np.cos(2 * np.pi * 120.0 * T), window_s=0.1, top_hz=400.0)
    at = np.argmin(np.abs(spectra.frequency_hz - 120.0))
    assert spectra.frequency_hz[at] == pytest.approx(120.0)
    # The line at -f leaks into f by less than 1e-3: 24 bins away, and Hann side lobes fall by 18 dB per octave.
    np.testing.assert_allclose(spectra.amplitude[:, at], 0.7, rtol=1e-3)
    assert spectra.amplitude.shape == (spectra.t.size, spectra.frequency_hz.size)


def test_windows_lie_inside_the_record() -> None:
    """The first and last window centre are half a window from the ends."""
    spectra = spectrogram(T, np.cos(2 * np.pi * 50.0 * T), window_s=0.2, top_hz=100.0)
    assert spectra.t[0] >= T[0] + 0.1 - 2e-3
    assert spectra.t[-1] <= T[-1] - 0.1 + 2e-3


def test_ridge_follows_a_chirp() -> None:
    """The ridge of a linear chirp is its instantaneous frequency at the window centre."""
    spectra = spectrogram(T, np.cos(2 * np.pi * (100.0 * T + 5.0 * T**2)), window_s=0.15, top_hz=300.0)
    # Quadratic peak interpolation on the padded spectrum errs by less than 2 % of a bin of 1/(4 window) Hz.
    np.testing.assert_allclose(ridge_hz(spectra, 110.0, 40.0), 100.0 + 10.0 * spectra.t, atol=0.05)


def test_uneven_steps_are_resampled_and_even_ones_kept() -> None:
    """Even input passes through; uneven input keeps its ends and its number of samples."""
    assert uniform_samples(T, T)[0] is T
    uneven = T**1.01
    even, values = uniform_samples(uneven, 3.0 * uneven)
    np.testing.assert_allclose(np.diff(even), (uneven[-1] - uneven[0]) / (T.size - 1))
    np.testing.assert_allclose(values, 3.0 * even, rtol=1e-12, atol=1e-15)


def test_window_that_does_not_fit_is_refused() -> None:
    """Longer than the record, or only a few samples."""
    for window_s in (3.0, 1e-3):
        with pytest.raises(InputError, match="window"):
            spectrogram(T, T, window_s, 100.0)


def test_ridge_needs_bins() -> None:
    """A band between two bins holds no ridge."""
    with pytest.raises(InputError, match="three bins"):
        ridge_hz(spectrogram(T, T, 0.1, 100.0), 52.0, 0.5)
