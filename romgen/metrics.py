"""Error and signal measures: NMTE, sqrt(2) RMS, instantaneous amplitude, frequency and damping."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import hilbert

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError


def nmte_percent(x: FloatArray, x_rec: FloatArray) -> float:
    """Return the normalised mean trajectory error 100 sum_k |x_k - xrec_k| / (L max_k |x_k|) in percent.

    Parameters
    ----------
    x, x_rec : (n_time, n) true and reconstructed trajectory, one unit for all columns.

    Source: Morsy, Xu, Tiso, Haller 2024, eq. NMTE.
    """
    if x.shape != x_rec.shape:
        raise InputError("trajectories of different shape", where="nmte_percent", value=(x.shape, x_rec.shape))
    largest = float(np.linalg.norm(x, axis=1).max())
    return 100.0 * float(np.linalg.norm(x - x_rec, axis=1).mean()) / largest


@dataclass(frozen=True)
class Instantaneous:
    """Slowly varying amplitude, frequency and damping ratio of one decaying oscillation.

    Attributes
    ----------
    t : (n_time,) s, ends dropped.
    amplitude : (n_time,) unit of the signal.
    frequency_hz : (n_time,)
    damping_ratio : (n_time,) -A'/(A omega).
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    amplitude: FloatArray = field(metadata={"unit": "signal", "axes": "time"})
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "time"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "time"})


def analytic_signal(t: FloatArray, x: FloatArray, band_hz: tuple[float, float]) -> ComplexArray:
    """Return the analytic signal of x in a frequency band, x = Re: a smooth band-pass without negative frequencies.

    Parameters
    ----------
    t : (n_time,) s, uniform.
    x : (n_time,) real signal; its even mirror image is appended, so a decay does not wrap around.
    band_hz : lower and upper edge; raised-cosine flanks of a tenth of the band width lie outside of it.
    """
    mirrored = np.concatenate([x, x[::-1]])
    frequency = np.fft.fftfreq(len(mirrored), t[1] - t[0])
    low, high = band_hz
    flank = 0.1 * (high - low)
    distance = np.maximum(np.maximum(low - frequency, frequency - high), 0.0) / flank
    window = np.where(distance < 1.0, 0.5 * (1.0 + np.cos(np.pi * np.minimum(distance, 1.0))), 0.0)
    spectrum = np.fft.fft(hilbert(mirrored)) * window
    signal: ComplexArray = np.fft.ifft(spectrum)[: len(x)]
    return signal


def instantaneous(t: FloatArray, x: FloatArray, band_hz: tuple[float, float]) -> Instantaneous:
    """Return instantaneous amplitude, frequency and damping of the part of x in a band.

    With the analytic signal s = A e^(i theta): frequency theta'/2 pi, damping ratio -A'/(A theta'). Five periods of
    the band's lower edge are dropped at both ends, where a band-pass is not defined.

    Parameters
    ----------
    t : (n_time,) s, uniform.
    x : (n_time,)
    """
    s = analytic_signal(t, x, band_hz)
    rate = np.gradient(np.log(np.abs(s)), t) + 1j * np.gradient(np.unwrap(np.angle(s)), t)
    drop = int(np.ceil(5.0 / (band_hz[0] * (t[1] - t[0]))))
    if len(t) <= 2 * drop:
        raise InputError("too short for a band-pass", where="instantaneous", value=len(t), advice=f"needs {2 * drop}")
    keep = slice(drop, len(t) - drop)
    return Instantaneous(
        t=t[keep],
        amplitude=np.abs(s[keep]),
        frequency_hz=rate.imag[keep] / (2.0 * np.pi),
        damping_ratio=-rate.real[keep] / rate.imag[keep],
    )
