"""Instantaneous frequency and damping of a decay, recorded against reduced model."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from romgen.arrays import FloatArray
from romgen.metrics import Instantaneous, instantaneous
from romgen.report.blocks import FigureBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.inputs import Reconstruction
from romgen.report.style import BLACK, VERMILLION, label, new_figure
from romgen.spectrogram import uniform_samples

# Half width of the band of a mode relative to its frequency, and the least amplitude shown relative to the largest.
_HALF_BAND, _LEAST = 0.2, 0.03
_NEEDED_PERIODS = 15.0


def mode_motion(t: FloatArray, x: FloatArray, frequency_hz: float) -> Instantaneous:
    """Slow amplitude, frequency and damping of the part of x around a frequency, small amplitudes cut off.

    Parameters
    ----------
    t, x : (n_time,) s and signal; uneven steps are resampled.
    frequency_hz : centre of a band of -/+ 20 %.
    """
    band = ((1.0 - _HALF_BAND) * frequency_hz, (1.0 + _HALF_BAND) * frequency_hz)
    motion = instantaneous(*uniform_samples(t, x), band)
    kept = motion.amplitude >= _LEAST * motion.amplitude.max()
    columns = (motion.t, motion.amplitude, motion.frequency_hz, motion.damping_ratio)
    return Instantaneous(*(column[kept] for column in columns))


def long_enough(pair: Reconstruction, frequency_hz: FloatArray) -> bool:
    """Whether anything is left once the band-pass of the lowest mode has lost five periods at both ends."""
    t = pair.trajectory.t
    return bool(t[-1] - t[0] > _NEEDED_PERIODS / ((1.0 - _HALF_BAND) * frequency_hz[0]))


def strongest_sensor(pair: Reconstruction, frequency_hz: float) -> int:
    """Column with the largest amplitude around a frequency."""
    x = pair.trajectory.displacement
    peaks = [mode_motion(pair.trajectory.t, x[:, k], frequency_hz).amplitude.max() for k in range(x.shape[1])]
    return int(np.argmax(peaks))


def instantaneous_figure(pair: Reconstruction, frequency_hz: FloatArray) -> FigureBlock:
    """Frequency and damping ratio against amplitude, one row per master mode.

    Parameters
    ----------
    pair : the motion.
    frequency_hz : (m,) linear frequencies of the master modes.
    """
    figure = new_figure(2.3 * frequency_hz.size + 0.3)
    grid = figure.subplots(frequency_hz.size, 2, squeeze=False)
    tables: list[CurveTable] = []
    for k, (row, f) in enumerate(zip(grid, frequency_hz, strict=True)):
        sensor = strongest_sensor(pair, float(f))
        name = pair.trajectory.sensors[sensor]
        for x, source in ((pair.trajectory.displacement, "reference"), (pair.displacement, "reduced_model")):
            motion = mode_motion(pair.trajectory.t, x[:, sensor], float(f))
            _draw(row, motion, source)
            tables.append(_table(f"instantaneous_{pair.trajectory.name}_mode{k + 1}_{source}", motion))
        label(row[0], f"amplitude of {name} [mm]", "frequency [Hz]", f"mode {k + 1}: frequency")
        label(row[1], f"amplitude of {name} [mm]", "damping ratio [%]", "damping ratio")
    grid[0, 0].legend(loc="best")
    caption = (
        f"{pair.trajectory.name}: frequency and damping ratio of each mode against its peak amplitude while the motion "
        f"decays (from right to left), from the analytic signal in a band of ±{100 * _HALF_BAND:.0f} % around the "
        "linear frequency. Loops and wiggles are energy exchanged between the modes, so the "
        "reduced model should repeat them."
    )
    return FigureBlock(f"instantaneous_{pair.trajectory.name}", figure, caption, tuple(tables))


def _draw(row: tuple[Axes, Axes], motion: Instantaneous, source: str) -> None:
    """Both panels of one mode."""
    colour, line = (BLACK, "-") if source == "reference" else (VERMILLION, "--")
    for axes, y in zip(row, (motion.frequency_hz, 100.0 * motion.damping_ratio), strict=True):
        axes.plot(
            1e3 * motion.amplitude, y, linewidth=1.1, color=colour, linestyle=line, label=source.replace("_", " ")
        )


def _table(name: str, motion: Instantaneous) -> CurveTable:
    """The drawn curves."""
    return curve_table(
        name,
        ("time", "s", motion.t),
        ("amplitude", "m", motion.amplitude),
        ("frequency", "Hz", motion.frequency_hz),
        ("damping ratio", "1", motion.damping_ratio),
    )
