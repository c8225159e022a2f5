"""Spectral lines of sensor data above their noise, measured on the data themselves.

Records are cut into overlapping stretches of some periods each, so that a decay shows where it is strong. The floor of
a stretch is the median over its frequencies, which a few lines do not move; rounding to decimals makes it follow the
motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import BoolArray, FloatArray
from romgen.differences import SECOND
from romgen.errors import InputError

# A stretch has so many periods of the strongest line; stretches overlap by half.
STRETCH_PERIODS = 20.0
# Half width in bins of a line in the spectrum of the window sin^4, which falls off as the fifth power beyond.
LOBE = 3
# So many samples leave one frequency beside offsets and drift.
FEWEST = 2 * (LOBE + 1)
# Equivalent noise bandwidth of sin^4 in bins (Harris, Proc. IEEE 66 (1978) 51-83): closer lines are one.
RESOLUTION = 35.0 / 18.0
# White noise passes for a line anywhere in the spectra of a study with this probability.
FALSE_ALARM = 0.01


@dataclass(frozen=True)
class LineSpectrum:
    """Short-time spectra of all sensors together, in units of the variance of a sample.

    Attributes
    ----------
    frequency_hz : (n_frequency,) Hz.
    power : (n_stretch, n_frequency) sum over sensors; white noise of variance s^2 has the mean n_sensor s^2.
    floor : (n_stretch,) mean power of the noise.
    """

    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "frequency"})
    power: FloatArray = field(metadata={"unit": "m^2", "axes": "stretch,frequency"})
    floor: FloatArray = field(metadata={"unit": "m^2", "axes": "stretch"})

    @property
    def significant(self) -> BoolArray:
        """Where the power is no chance of the noise, (n_stretch, n_frequency).

        The power of noise in one sensor exceeds L times its mean with probability exp(-L), that of several sensors
        less often.
        """
        above: BoolArray = self.power > self.floor[:, None] * np.log(self.power.size / FALSE_ALARM)
        above[:, : LOBE + 1] = False  # offsets and drift
        return above

    @property
    def noise(self) -> float:
        """Variance of the noise of a sample, all sensors together, mean over the stretches, m^2."""
        return float(self.floor.mean())

    @property
    def signal(self) -> FloatArray:
        """Mean power above the noise at significant frequencies, 0 at others, (n_frequency,)."""
        above = np.maximum(self.power.mean(axis=0) - self.noise, 0.0)
        return np.where(self.significant.any(axis=0), above, 0.0)

    @property
    def resolution_hz(self) -> float:
        """Distance in Hz within which two lines are one."""
        return float(RESOLUTION * self.frequency_hz[1])

    def bin_of(self, frequency_hz: float) -> int:
        """Return the number of the frequency nearest to one in Hz."""
        return round(frequency_hz / float(self.frequency_hz[1]))


def line_spectrum(samples: Sequence[FloatArray], step: float) -> LineSpectrum:
    """Return the spectra of stretches of all records under the window sin^4.

    Parameters
    ----------
    samples : (n_time, n_sensor) of each record, m; step : s.

    Raises
    ------
    InputError : a record too short for a spectrum.
    """
    shortest = min(map(len, samples))
    if shortest < FEWEST:
        advice = f"give at least {FEWEST} samples"
        raise InputError("too short for a spectrum", where="sensor chart", value=f"{shortest} samples", advice=advice)
    period = strongest_period(max(samples, key=len))
    length = min(max(FEWEST, int(np.ceil(STRETCH_PERIODS * period))), shortest)
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length)[:, None] ** 4
    window /= np.sqrt(np.sum(window**2))
    power = []
    for x in samples:
        moving = x - x.mean(axis=0)
        for first in range(0, len(x) - length + 1, max(1, length // 2)):
            spectrum = np.fft.rfft(window * moving[first : first + length], axis=0)
            power.append(np.sum(np.abs(spectrum) ** 2, axis=1))
    # median over mean of a chi-squared variable with two degrees of freedom per sensor (Wilson and Hilferty 1931)
    share = (1.0 - 1.0 / (9.0 * samples[0].shape[1])) ** 3
    stacked = np.array(power)
    floor: FloatArray = np.asarray(np.median(stacked[:, LOBE + 1 :], axis=1)) / share
    return LineSpectrum(np.fft.rfftfreq(length, step).astype(np.float64), stacked, floor)


def strongest_period(x: FloatArray) -> float:
    """Return the period of the strongest spectral line of x (n_time, n_sensor) in samples."""
    power = np.sum(np.abs(np.fft.rfft(x - x.mean(axis=0), axis=0)) ** 2, axis=1)
    return len(x) / max(1, int(power.argmax()))


def line_frequencies(spectrum: LineSpectrum) -> FloatArray:
    """Return the frequencies in Hz at which any stretch has a peak above the noise, ascending.

    One line appears at as many frequencies as its stretches show: it moves with the amplitude.
    """
    P = spectrum.power
    peak = (P[:, 1:-1] >= P[:, :-2]) & (P[:, 1:-1] > P[:, 2:]) & spectrum.significant[:, 1:-1]
    found: FloatArray = spectrum.frequency_hz[1:-1][peak.any(axis=0)]
    return found


def separate_lines(spectrum: LineSpectrum, share: float) -> tuple[float, ...]:
    """Return the strongest frequency in Hz of every group of lines that the resolution tells apart.

    Lines of less than ``share`` of the amplitude of the strongest are left out.
    """
    amplitude = np.sqrt(spectrum.power.max(axis=0))
    found = [f for f in line_frequencies(spectrum) if amplitude[spectrum.bin_of(f)] >= share * amplitude.max()]
    groups = np.split(np.array(found), np.flatnonzero(np.diff(found) > spectrum.resolution_hz) + 1)
    return tuple(float(max(g, key=lambda f: amplitude[spectrum.bin_of(f)])) for g in groups if g.size)


def signal_end_hz(spectrum: LineSpectrum) -> float:
    """Return the frequency f_c up to which accelerations hold more signal than noise.

    f_c minimises what a sharp low-pass would lose and let through, with P the mean power and N the floor,

        sum_{f > f_c} f^4 max(P - N, 0) + sum_{f <= f_c} f^4 N,

    over the significant frequencies (Wiener's filter among those that only pass or stop).
    """
    weight, signal = spectrum.frequency_hz**4, spectrum.signal
    lost = np.sum(weight * signal) - np.cumsum(weight * signal)
    return float(spectrum.frequency_hz[np.argmin(lost + np.cumsum(weight) * spectrum.noise)])


def acceleration_noise(spectrum: LineSpectrum, step: float) -> float:
    """Return the noise in second differences of order 8 relative to the signal in them, both RMS."""
    omega = 2.0 * np.pi * spectrum.frequency_hz
    # both halves of the spectrum, mean over the frequencies of a stretch
    moving = float(np.sum(omega**4 * spectrum.signal)) / len(omega)
    gain = (2.0 * sum(SECOND)) ** 2 + 2.0 * sum(weight**2 for weight in SECOND)
    return float(np.sqrt(gain * spectrum.noise / max(moving, np.finfo(float).tiny))) / step**2
