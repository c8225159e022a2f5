"""Short-time spectra of a decaying signal and the ridge of a mode in them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from romgen.arrays import FloatArray
from romgen.errors import InputError


@dataclass(frozen=True)
class Spectrogram:
    """Amplitude of a signal over time and frequency: a steady A cos(2 pi f t) shows the value A at f.

    Attributes
    ----------
    t : (n_time,) s, centres of the windows.
    frequency_hz : (n_frequency,) Hz, ascending from 0.
    amplitude : (n_time, n_frequency) peak amplitude in the unit of the signal.
    window_s : length of the Hann window in s.
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "frequency"})
    amplitude: FloatArray = field(metadata={"unit": "of the signal", "axes": "time,frequency"})
    window_s: float


def uniform_samples(t: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The signal on an even time grid with as many samples; even input is returned unchanged.

    Uneven steps (adaptive integration) are filled by linear interpolation. ``t`` (n_time,) s increasing,
    ``x`` (n_time,) any unit.
    """
    steps = np.diff(t)
    if np.ptp(steps) <= 1e-6 * steps.mean():
        return t, x
    even = np.linspace(t[0], t[-1], t.size)
    return even, np.interp(even, t, x)


def spectrogram(t: FloatArray, x: FloatArray, window_s: float, top_hz: float) -> Spectrogram:
    """Short-time Fourier amplitude 2 |sum_k w_k x_k exp(-2 pi i f t_k)| / sum_k w_k with a Hann window w.

    Only windows that lie inside the record are kept, so the ends show no false decay. Neighbouring windows
    overlap by 7/8 (fewer windows where the record is so long that they would exceed about 400).

    Parameters
    ----------
    t, x : (n_time,) s and signal.
    window_s : length of the window in s; the resolution is about 2 / window_s in Hz.
    top_hz : highest frequency kept.

    Raises
    ------
    InputError : the record is shorter than one window or the window shorter than 8 samples.

    Source: Gabor 1946; scaling "magnitude" of scipy.signal.ShortTimeFFT.
    """
    even, signal = uniform_samples(t, x)
    step = float(even[1] - even[0])
    length = round(window_s / step)
    if not 8 <= length <= signal.size:
        raise InputError(
            "the window does not fit the record",
            where="spectrogram",
            value=f"{length} samples per window, {signal.size} in the record",
            advice="choose window_s between 8 time steps and the record length",
        )
    hop = max(1, length // 8, signal.size // 400)
    transform = ShortTimeFFT(hann(length, sym=False), hop, 1.0 / step, mfft=4 * length, scale_to="magnitude")
    inside = slice(transform.lower_border_end[1], transform.upper_border_begin(signal.size)[1])
    centres = np.arange(inside.start, inside.stop)
    amplitude = 2.0 * np.abs(transform.stft(signal, p0=inside.start, p1=inside.stop))
    kept = transform.f <= top_hz
    return Spectrogram(even[0] + centres * hop * step, transform.f[kept], amplitude[kept].T.copy(), window_s)


def ridge_hz(spectra: Spectrogram, around_hz: float, half_width_hz: float) -> FloatArray:
    """Frequency of the largest amplitude within around_hz -/+ half_width_hz at every time, (n_time,) Hz.

    The peak is refined by the parabola through the log amplitudes of the largest bin and its neighbours, so
    the ridge is not quantised to the frequency bins.

    Raises
    ------
    InputError : the band holds fewer than three bins inside the spectrum.

    Source: J. O. Smith, Spectral Audio Signal Processing, quadratic interpolation of spectral peaks.
    """
    f = spectra.frequency_hz
    band = np.flatnonzero(np.abs(f - around_hz) <= half_width_hz)
    band = band[(band > 0) & (band < f.size - 1)]
    if band.size < 3:
        raise InputError("the band of the ridge holds fewer than three bins", where="spectrogram", value=around_hz)
    peak = band[np.argmax(spectra.amplitude[:, band], axis=1)]
    rows = np.arange(spectra.t.size)
    log_a = np.log(np.maximum(spectra.amplitude, np.finfo(float).tiny))
    left, centre, right = log_a[rows, peak - 1], log_a[rows, peak], log_a[rows, peak + 1]
    curvature = left - 2.0 * centre + right
    is_peak = curvature < 0.0
    shift = np.where(is_peak, 0.5 * (left - right) / np.where(is_peak, curvature, 1.0), 0.0)
    refined: FloatArray = f[peak] + np.clip(shift, -0.5, 0.5) * (f[1] - f[0])
    return refined
