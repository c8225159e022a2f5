"""Spectrograms of a decay with the lines of the internal resonance."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from romgen.arrays import FloatArray
from romgen.report.blocks import FigureBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.inputs import Reconstruction
from romgen.report.style import SEQUENTIAL, label, new_figure, no_grid
from romgen.spectrogram import Spectrogram, ridge_hz, spectrogram

_CYCLES_PER_WINDOW = 14
_RANGE_DB = 70.0


def _spectra(pair: Reconstruction, low_hz: float, top_hz: float) -> tuple[Spectrogram, Spectrogram]:
    """Spectrograms of the main sensor, recorded and reduced."""
    k, t = pair.main_sensor, pair.trajectory.t
    window_s = min(_CYCLES_PER_WINDOW / low_hz, 0.5 * (t[-1] - t[0]))
    recorded = spectrogram(t, pair.trajectory.displacement[:, k], window_s, top_hz)
    return recorded, spectrogram(t, pair.displacement[:, k], window_s, top_hz)


def _draw(axes: Axes, spectra: Spectrogram, peak: float, lines: FloatArray) -> QuadMesh:
    """Level in dB below the peak, with the ridge of the first mode and its multiples."""
    level = 20.0 * np.log10(np.maximum(spectra.amplitude / peak, 1e-12))
    mesh = axes.pcolormesh(
        spectra.t, spectra.frequency_hz, level.T, cmap=SEQUENTIAL, vmin=-_RANGE_DB, vmax=0.0, shading="nearest"
    )
    for k, line in enumerate(lines):
        axes.plot(spectra.t, line, color="white", linewidth=1.1, linestyle=("-", "--", ":")[min(k, 2)])
    no_grid(axes)
    return mesh


def _ridge_lines(spectra: Spectrogram, low_hz: float, multiples: tuple[int, ...]) -> FloatArray:
    """(n_line, n_time) Hz: ridge of the lowest mode times each r_j / r_1."""
    ridge = ridge_hz(spectra, low_hz, 0.3 * low_hz)
    return np.outer(np.array(multiples) / multiples[0], ridge)


def _matrix_table(
    name: str, spectra: Spectrogram, lines: FloatArray, multiples: tuple[int, ...]
) -> tuple[CurveTable, ...]:
    """The map as one row per (time, frequency) and the drawn lines."""
    time, frequency = np.meshgrid(spectra.t, spectra.frequency_hz, indexing="ij")
    columns = [(f"{r} x ridge / {multiples[0]}", "Hz", line) for r, line in zip(multiples, lines, strict=True)]
    return (
        curve_table(
            name,
            ("time", "s", time.ravel()),
            ("frequency", "Hz", frequency.ravel()),
            ("amplitude", "m", spectra.amplitude.ravel()),
        ),
        curve_table(f"{name}_ridge", ("time", "s", spectra.t), *columns),
    )


def spectrogram_figure(pair: Reconstruction, frequency_hz: FloatArray, resonance: tuple[int, ...]) -> FigureBlock:
    """Spectrogram of one motion, recorded beside reduced, with the ridge of mode 1 and its resonant multiples.

    Parameters
    ----------
    pair : the motion.
    frequency_hz : (m,) linear frequencies of the master modes, marked at the right edge.
    resonance : integers r_j, e.g. (1, 2); () draws the ridge alone.
    """
    multiples = resonance if resonance else (1,)
    low, top = float(frequency_hz[0]), 1.6 * float(frequency_hz[-1])
    both = _spectra(pair, low, top)
    figure = new_figure(3.3)
    grid = figure.subplots(1, 2, sharey=True)
    name, peak = pair.trajectory.name, float(both[0].amplitude.max())
    tables: list[CurveTable] = []
    for axes, spectra, source in zip(grid, both, ("reference", "reduced_model"), strict=True):
        lines = _ridge_lines(spectra, low, multiples)
        mesh = _draw(axes, spectra, peak, lines)
        label(axes, "time [s]", "frequency [Hz]" if axes is grid[0] else "", source.replace("_", " "))
        tables += _matrix_table(f"spectrogram_{name}_{source}", spectra, lines, multiples)
    _mark_linear(figure, grid[1], frequency_hz)
    figure.colorbar(mesh, ax=grid, label="level [dB re largest amplitude]", pad=0.03)
    caption = _caption(pair, multiples, both[0].window_s)
    return FigureBlock(f"spectrogram_{name}", figure, caption, tuple(tables), "png")


def _mark_linear(figure: Figure, axes: Axes, frequency_hz: FloatArray) -> None:
    """Ticks at the right edge where the linear modes lie."""
    right = axes.secondary_yaxis("right")
    right.set_yticks(frequency_hz, [f"$f_{k + 1}$" for k in range(frequency_hz.size)])
    figure.canvas.draw_idle()


def _caption(pair: Reconstruction, multiples: tuple[int, ...], window_s: float) -> str:
    """What to look at in the spectrogram."""
    lines = "the measured ridge of mode 1 (solid)"
    if len(multiples) > 1:
        lines += f" and {' and '.join(f'{r}/{multiples[0]}' for r in multiples[1:])} times it (dashed)"
    return (
        f"{pair.trajectory.name}, sensor “{pair.trajectory.sensors[pair.main_sensor]}”: spectrogram of the record "
        f"and of the reduced model with the same colour scale (Hann window of {1e3 * window_s:.0f} ms). "
        f"White: {lines}. A second ridge on the dashed line, while both frequencies drift, is motion locked by the "
        "internal resonance; away from it, near its linear frequency, the second mode moves on its own."
    )
