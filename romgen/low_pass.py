"""Noisy, finely sampled sensors: a linear-phase low-pass before derivatives, and fewer samples after it.

Differences over a step h carry the noise of a sample times 1/h^2 into accelerations, so that finer sampling of the same
motion makes them worse. Above the last spectral line there is nothing but noise: it is taken off, and as many samples
are kept as a period of the fastest motion needs. What sampling finer than this adds is then averaged and not wasted.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import kaiser_beta, oaconvolve
from scipy.signal.windows import kaiser

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.noise_floor import LineSpectrum, acceleration_noise, signal_end_hz

# Noise in second differences relative to their signal above which they are smoothed: what differences of order 8 err by
# themselves with seven samples in a period. Decimals with six digits reach it at 5 kHz for motions of 50 Hz.
SMOOTHED = 1e-3
# The low-pass ends here, in units of the last frequency that it passes: its length is 1/(STOP - 1) of that period, and
# more noise passes the wider this is.
STOP = 2.5
# Largest error of the gain, in dB: below the noise of any record that is smoothed.
RIPPLE_DB = 80.0
# Samples left in a period of the last frequency passed: differences of order 8 err by (2 pi / 10)^8 / 630 = 4e-5.
SAMPLES_LEFT = 10.0


@dataclass(frozen=True)
class LowPass:
    """A symmetric finite impulse response and the samples kept after it.

    Attributes
    ----------
    taps : (n_tap,) odd, sum 1; half of them less one is lost at both ends.
    stride : every so many samples one is kept.
    pass_hz : last frequency that is passed unchanged.
    noise : RMS noise of a sample over all sensors, relative to the largest motion.
    """

    taps: FloatArray = field(metadata={"unit": "1", "axes": "tap"})
    stride: int
    pass_hz: float
    noise: float

    @property
    def noise_gain(self) -> float:
        """RMS of white noise after the low-pass relative to that before."""
        return float(np.linalg.norm(self.taps))


def low_pass(spectrum: LineSpectrum, step: float, largest: float) -> LowPass | None:
    """Return the low-pass that noisy data need before their derivatives are taken; None where they need none.

    A sinc of cutoff (1 + STOP) f_c / 2 under a Kaiser window, f_c the last frequency with signal in it.

    Parameters
    ----------
    spectrum : of the training data; step : their time step in s.
    largest : largest norm of the displacement, m.

    Source: Kaiser 1974, length and shape of the window from ripple and width of the transition.
    """
    end = signal_end_hz(spectrum)
    if end == 0.0 or STOP * end >= 0.5 / step or acceleration_noise(spectrum, step) <= SMOOTHED:
        return None
    half = int(np.ceil((RIPPLE_DB - 7.95) / (2.285 * 2.0 * np.pi * (STOP - 1.0) * end * step) / 2.0))
    k = np.arange(-half, half + 1)
    taps = np.sinc((1.0 + STOP) * end * step * k) * kaiser(2 * half + 1, kaiser_beta(RIPPLE_DB))
    return LowPass(
        taps=taps / taps.sum(),
        stride=max(1, int(1.0 / (SAMPLES_LEFT * end * step))),
        pass_hz=end,
        noise=float(np.sqrt(spectrum.noise)) / largest,
    )


def smoothed(filtered: LowPass, t: FloatArray, x: FloatArray, where: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times kept (n_kept,), displacement as recorded and as smoothed there, (n_kept, n_sensor).

    Raises
    ------
    InputError : not more samples than taps.
    """
    half = len(filtered.taps) // 2
    if len(x) <= 2 * half:
        raise InputError(
            "trajectory shorter than the low-pass that its noise needs",
            where=where,
            value=f"{len(x)} samples",
            advice=f"at least {2 * half + 1} samples are needed",
        )
    smooth = oaconvolve(x, filtered.taps[:, None], mode="valid", axes=0)[:: filtered.stride]
    inner = slice(half, len(x) - half, filtered.stride)
    return t[inner], x[inner], smooth
