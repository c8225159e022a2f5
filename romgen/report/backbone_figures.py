"""Frequency and damping ratio of the modes against amplitude."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from romgen.arrays import FloatArray
from romgen.backbone import Backbone
from romgen.confidence_band import ConfidenceBand
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


def backbone_figure(
    curves: tuple[Backbone, ...], sensor: str | None, measure: Measure, bands: tuple[ConfidenceBand, ...] = ()
) -> FigureBlock:
    """One row per mode: frequency and damping ratio against amplitude; beyond training drawn thin.

    Parameters
    ----------
    curves : backbones of any modes.
    sensor : where the amplitude is observed; None takes for every mode the sensor that sees most of it.
    measure : name of the amplitude.
    bands : confidence limits of each curve, or ().
    """
    limits: tuple[ConfidenceBand | None, ...] = bands or (None,) * len(curves)
    modes = sorted({curve.mode for curve in curves})
    figure = new_figure(2.4 * len(modes) + 0.3)
    grid = figure.subplots(len(modes), 2, squeeze=False)
    tables: list[CurveTable] = []
    for row, mode in zip(grid, modes, strict=True):
        seen = sensor or strongest_sensor(curves, mode)
        for curve, band in zip(curves, limits, strict=True):
            if curve.mode == mode:
                tables.append(_table(curve, seen, measure, band))
                _draw(row, curve, 1e3 * tables[-1]["amplitude"])
                if band is not None:
                    _shade(row, curve, 1e3 * tables[-1]["amplitude"], band)
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
    if bands:
        caption += (
            f" Shaded: {100.0 * bands[0].level:.0f} % confidence limits from the spread of the coefficients between "
            "blocks of the training motions (delete-one-block jackknife); errors that all blocks share are not in it."
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


def _shade(row: tuple[Axes, Axes], curve: Backbone, amplitude_mm: FloatArray, band: ConfidenceBand) -> None:
    """Both panels: the area between the limits; very wide ones are cut at twice the height of the curves."""
    colour = VERMILLION if curve.slaved else BLUE
    for axes, limits in zip(row, (band.frequency_hz, 100.0 * band.damping_ratio), strict=True):
        low, high = axes.get_ylim()
        axes.fill_between(amplitude_mm, *limits.T, color=colour, alpha=0.15, linewidth=0.0)
        lowest, highest = axes.get_ylim()
        axes.set_ylim(max(lowest, 3.0 * low - 2.0 * high), min(highest, 3.0 * high - 2.0 * low), auto=True)


def _table(curve: Backbone, sensor: str, measure: Measure, band: ConfidenceBand | None) -> CurveTable:
    """The drawn curve and its limits."""
    kind = "locked" if curve.slaved else "alone"
    columns: tuple[tuple[str, str, FloatArray], ...] = ()
    if band is not None:
        names = (("frequency", "Hz", band.frequency_hz), ("damping ratio", "1", band.damping_ratio))
        columns = tuple(
            (f"{name} {end} limit", unit, limits[:, k])
            for name, unit, limits in names
            for k, end in enumerate(("lower", "upper"))
        )
    return curve_table(
        f"backbone_mode{curve.mode + 1}_{kind}",
        ("amplitude", "m", backbone_amplitude(curve, sensor, measure)),
        ("frequency", "Hz", curve.frequency_hz),
        ("damping ratio", "1", curve.damping_ratio),
        ("rho", "1", curve.rho),
        ("beyond training", "0 no 1 yes", curve.exceeds_trained_range),
        *columns,
    )
