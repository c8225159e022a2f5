"""Frequency and damping ratio of the modes against amplitude."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from romgen.arrays import FloatArray
from romgen.backbone import Backbone
from romgen.lifted_orbit import Measure
from romgen.report.blocks import FigureBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.style import BLUE, VERMILLION, label, new_figure

MEASURE_NAMES = {"max": "max |x|", "sqrt2_rms": "√2 RMS"}


def backbone_amplitude(curve: Backbone, sensor: str, measure: Measure) -> FloatArray:
    """(n,) m: amplitude of one sensor along the backbone."""
    table = curve.amplitude_max if measure == "max" else curve.amplitude_sqrt2_rms
    amplitude: FloatArray = table[:, curve.sensors.index(sensor)]
    return amplitude


def backbone_name(curve: Backbone) -> str:
    """Which mode, and what the other modes do."""
    return f"mode {curve.mode + 1}, others {'phase-locked' if curve.slaved else 'at rest'}"


def strongest_sensor(curves: tuple[Backbone, ...], mode: int) -> str:
    """The sensor that sees most of a mode."""
    curve = next(curve for curve in curves if curve.mode == mode)
    return curve.sensors[int(np.argmax(curve.amplitude_max.max(axis=0)))]


def backbone_figure(curves: tuple[Backbone, ...], sensor: str | None, measure: Measure) -> FigureBlock:
    """One row per mode: frequency and damping ratio against amplitude; beyond training drawn thin.

    Parameters
    ----------
    curves : backbones of any modes.
    sensor : where the amplitude is observed; None takes for every mode the sensor that sees most of it.
    measure : name of the amplitude.
    """
    modes = sorted({curve.mode for curve in curves})
    figure = new_figure(2.4 * len(modes) + 0.3)
    grid = figure.subplots(len(modes), 2, squeeze=False)
    tables: list[CurveTable] = []
    for row, mode in zip(grid, modes, strict=True):
        seen = sensor or strongest_sensor(curves, mode)
        for curve in (curve for curve in curves if curve.mode == mode):
            tables.append(_table(curve, seen, measure))
            _draw(row, curve, 1e3 * tables[-1]["amplitude"])
        axis = f"{MEASURE_NAMES[measure]} of {seen} [mm]"
        label(row[0], axis, "frequency [Hz]", f"mode {mode + 1}: backbone")
        label(row[1], axis, "damping ratio [%]", "damping ratio")
        row[0].legend(loc="best")
    caption = (
        "Free vibration of the reduced model: frequency and damping ratio of each mode against the displacement "
        f"amplitude ({MEASURE_NAMES[measure]} over one period, about the rest state). Damping is -Re(ż/z) over the "
        "frequency. Solid: the other modes at rest; dashed: the other modes locked in phase by the internal resonance. "
        "Thin: beyond the trained range."
    )
    return FigureBlock("backbone", figure, caption, tuple(tables))


def _draw(row: tuple[Axes, Axes], curve: Backbone, amplitude_mm: FloatArray) -> None:
    """Both panels of one backbone; the part beyond training in a thin line."""
    colour, line = (VERMILLION, "--") if curve.slaved else (BLUE, "-")
    trained = ~curve.exceeds_trained_range
    name = "phase-locked" if curve.slaved else "others at rest"
    for axes, y in zip(row, (curve.frequency_hz, 100.0 * curve.damping_ratio), strict=True):
        axes.plot(amplitude_mm, y, color=colour, linestyle=line, linewidth=0.6)
        axes.plot(amplitude_mm, np.where(trained, y, np.nan), color=colour, linestyle=line, label=name)


def _table(curve: Backbone, sensor: str, measure: Measure) -> CurveTable:
    """The drawn curve."""
    kind = "locked" if curve.slaved else "alone"
    return curve_table(
        f"backbone_mode{curve.mode + 1}_{kind}",
        ("amplitude", "m", backbone_amplitude(curve, sensor, measure)),
        ("frequency", "Hz", curve.frequency_hz),
        ("damping ratio", "1", curve.damping_ratio),
        ("rho", "1", curve.rho),
        ("beyond training", "0 no 1 yes", curve.exceeds_trained_range),
    )
