"""Frequency response curves with stability, folds, backbone and trained range."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from romgen.arrays import BoolArray, FloatArray
from romgen.backbone import Backbone
from romgen.forced_curve import ForcedCurve, ForcedResponse
from romgen.forced_validation import ForcedPoint
from romgen.load_calibration import CalibratedPoint, InputLoad
from romgen.reduced_model import ReducedModel
from romgen.report.backbone_figures import MEASURE_NAMES, backbone_amplitude
from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.style import BLACK, CYCLE, GREY, SHADE, label, new_figure, unit_text

_THIN, _THICK = 0.7, 1.6


def curve_name(curve: ForcedCurve) -> str:
    """Level with unit, and the number of the branch where it is not the main one."""
    return f"{curve.level:g} {unit_text(curve.unit)}" + (f", branch {curve.branch}" if curve.branch else "")


def curve_amplitude(response: ForcedResponse, curve: ForcedCurve) -> FloatArray:
    """(n,) m: amplitude of the response's sensor in its measure along one curve."""
    table = curve.amplitude_max if response.measure == "max" else curve.amplitude_sqrt2_rms
    amplitude: FloatArray = table[:, response.sensors.index(response.sensor)]
    return amplitude


def _draw_branch(axes: Axes, curve: ForcedCurve, y: FloatArray, colour: str) -> None:
    """Solid where stable, dashed where not, thin beyond the trained range; pieces touch each other."""
    for unstable in (False, True):
        for beyond in (False, True):
            wanted = (curve.stable != unstable) & (curve.exceeds_trained_range == beyond)
            shown = np.where(_with_next(wanted), y, np.nan)
            line, width = ("--" if unstable else "-"), (_THIN if beyond else _THICK)
            axes.plot(curve.frequency_hz, shown, color=colour, linestyle=line, linewidth=width)
    axes.plot(curve.frequency_hz[curve.fold_index], y[curve.fold_index], "o", color=colour, markersize=5, mfc="white")


def _with_next(wanted: BoolArray) -> BoolArray:
    """The wanted points and the one after each, so that neighbouring pieces of a branch meet."""
    grown = wanted.copy()
    grown[1:] |= wanted[:-1]
    return grown


def _level_colours(curves: Sequence[ForcedCurve]) -> dict[float, str]:
    """One colour per level."""
    levels = sorted({curve.level for curve in curves})
    return {level: CYCLE[k % len(CYCLE)] for k, level in enumerate(levels)}


def _legend(axes: Axes, curves: Sequence[ForcedCurve], with_backbone: bool, crosses: Sequence[str]) -> None:
    """Levels by colour, the rest by line style."""
    colours = _level_colours(curves)
    unit = unit_text(curves[0].unit)
    handles = [Line2D([], [], color=colour, label=f"{level:g} {unit}") for level, colour in colours.items()]
    handles += [
        Line2D([], [], color=GREY, label="stable"),
        Line2D([], [], color=GREY, linestyle="--", label="unstable"),
    ]
    handles.append(Line2D([], [], color=GREY, marker="o", mfc="white", linestyle="", label="fold"))
    markers = {"finite elements": "x", "measured": "+"}
    handles += [Line2D([], [], color=GREY, marker=markers[c], mew=2.0, linestyle="", label=c) for c in crosses]
    if with_backbone:
        handles.append(Line2D([], [], color=BLACK, linestyle=":", label="backbone"))
    axes.legend(handles=handles, loc="upper right")


def response_figure(
    response: ForcedResponse,
    backbones: tuple[Backbone, ...],
    points: tuple[ForcedPoint, ...] = (),
    loads: tuple[InputLoad, ...] = (),
) -> FigureBlock:
    """Displacement amplitude against forcing frequency at all levels, backbones overlaid.

    Parameters
    ----------
    response : curves of all levels.
    backbones : only those inside the drawn frequencies are shown.
    points : full finite-element runs, drawn as crosses.
    loads : calibrated inputs; their measured points on the drawn curves are marked.
    """
    figure = new_figure(4.4)
    axes = figure.add_subplot()
    colours, tables = _level_colours(response.curves), []
    for curve in response.curves:
        y = curve_amplitude(response, curve)
        _draw_branch(axes, curve, 1e3 * y, colours[curve.level])
        tables.append(_table(response, curve))
    for point in points:
        axes.plot(point.frequency_hz, 1e3 * point.fe_m, "x", color=colours[point.load], markersize=8, mew=2.0)
    measured = _measured(response, loads)
    for at in measured:
        axes.plot(at.frequency_hz, 1e3 * at.measured_m, "+", color=colours[at.level], markersize=10, mew=2.0)
    axes.set_xlim(*_window(response))
    axes.set_ylim(bottom=0.0)
    drawn = [curve for curve in backbones if _overlay(axes, curve, response)]
    _legend(axes, response.curves, bool(drawn), ("finite elements",) * bool(points) + ("measured",) * bool(measured))
    measure = MEASURE_NAMES[response.measure]
    label(axes, "forcing frequency [Hz]", f"{measure} of {response.sensor} [mm]", "frequency response")
    caption = (
        f"Forced response of the reduced model: amplitude of sensor “{response.sensor}” ({measure} over one period, "
        "about the rest state, mean not removed). The level is the peak value of a cosine on the input. Solid: stable; "
        "dashed: unstable; circles: folds, where a sweep jumps; crosses: finite elements; plus signs: measured points "
        "that the load was calibrated on; thin: beyond the trained range. Shaded: amplitudes that the first backbone "
        "reaches inside the trained range."
    )
    return FigureBlock("frequency_response", figure, caption, tuple(tables))


def _measured(response: ForcedResponse, loads: tuple[InputLoad, ...]) -> list[CalibratedPoint]:
    """The measured points of the drawn input, sensor, measure and levels."""
    levels, drawn = {curve.level for curve in response.curves}, response.curves[0].input
    points = [point for load in loads if load.input == drawn for point in load.points]
    same = [p for p in points if (p.sensor, p.measure) == (response.sensor, response.measure)]
    return [point for point in same if point.level in levels]


def _window(response: ForcedResponse) -> tuple[float, float]:
    """Frequencies drawn: all points of all curves."""
    low = min(float(curve.frequency_hz.min()) for curve in response.curves)
    return low, max(float(curve.frequency_hz.max()) for curve in response.curves)


def _overlay(axes: Axes, curve: Backbone, response: ForcedResponse) -> bool:
    """Draw a backbone where it crosses the drawn window; shade the amplitudes it reaches in training."""
    low, high = axes.get_xlim()
    top = axes.get_ylim()[1]
    amplitude = 1e3 * backbone_amplitude(curve, response.sensor, response.measure)
    inside = (curve.frequency_hz > low) & (curve.frequency_hz < high) & (amplitude < top)
    if not np.any(inside & (amplitude > 0.02 * top)):
        return False
    axes.plot(curve.frequency_hz[inside], amplitude[inside], ":", color=BLACK, linewidth=1.2)
    if curve.mode == 0 and not curve.slaved:
        trained = amplitude[~curve.exceeds_trained_range]
        axes.axhspan(0.0, float(trained.max()), color=SHADE, zorder=0)
        axes.set_ylim(0.0, top)
    return True


def _table(response: ForcedResponse, curve: ForcedCurve) -> CurveTable:
    """The drawn curve, its stability and its modal amplitudes."""
    modal = [(f"abs z_{j + 1}", "1", np.abs(curve.q[:, j])) for j in range(curve.q.shape[1])]
    return curve_table(
        f"frequency_response_{curve.input}_{curve.level:g}_branch{curve.branch}",
        ("frequency", "Hz", curve.frequency_hz),
        (f"amplitude {response.measure} {response.sensor}", "m", curve_amplitude(response, curve)),
        ("stable", "0 no 1 yes", curve.stable),
        ("beyond training", "0 no 1 yes", curve.exceeds_trained_range),
        ("damping ratio", "1", curve.damping_ratio),
        *modal,
    )


def modal_figure(response: ForcedResponse, model: ReducedModel) -> FigureBlock:
    """Amplitude of each master mode against frequency, with its trained range shaded."""
    m = model.eigenvalues.size
    figure = new_figure(3.0)
    grid = figure.subplots(1, m, squeeze=False)[0]
    colours = _level_colours(response.curves)
    for j, axes in enumerate(grid):
        for curve in response.curves:
            _draw_branch(axes, curve, np.abs(curve.q[:, j]), colours[curve.level])
        top = axes.get_ylim()[1]
        axes.axhspan(0.0, min(model.trained_amplitude[j], top), color=SHADE, zorder=0)
        axes.set_xlim(*_window(response))
        axes.set_ylim(0.0, top)
        label(axes, "forcing frequency [Hz]", f"|z{j + 1}| [1]", f"mode {j + 1}")
    tables = tuple(
        curve_table(
            f"modal_response_{curve.input}_{curve.level:g}_branch{curve.branch}",
            ("frequency", "Hz", curve.frequency_hz),
            *((f"abs z_{j + 1}", "1", np.abs(curve.q[:, j])) for j in range(m)),
        )
        for curve in response.curves
    )
    caption = (
        "The same curves in normal-form amplitudes, colours and lines as above. Shaded: amplitudes of that mode that "
        "occur in the training motions. A second mode that rises where the first is forced is the internal resonance."
    )
    return FigureBlock("modal_response", figure, caption, tables)


def response_table(response: ForcedResponse) -> TableBlock:
    """Peaks, folds and other special points of every curve."""
    rows = tuple(_row(curve) for curve in response.curves)
    header = (
        "curve",
        "peak at [Hz]",
        "peak [mm]",
        "folds [Hz]",
        "Neimark-Sacker [Hz]",
        "phase resonance [Hz]",
        "unstable points [%]",
        "beyond training [%]",
    )
    caption = (
        f"Special points of every curve on input {response.curves[0].input}, amplitudes as "
        f"{MEASURE_NAMES[response.measure]} of {response.sensor}. "
        f"Computed by {response.route.replace('_', ' ')} continuation in {response.wall_s:.2f} s."
    )
    return TableBlock(caption, header, rows)


def _row(curve: ForcedCurve) -> tuple[str, ...]:
    """Text cells of one curve."""
    return (
        curve_name(curve),
        f"{curve.peak_hz:.3f}",
        f"{1e3 * curve.peak_m:.4f}",
        _listed(curve.folds_hz),
        _listed(curve.hopf_hz),
        _listed(curve.phase_resonance_hz),
        f"{100.0 * np.mean(~curve.stable):.0f}",
        f"{100.0 * np.mean(curve.exceeds_trained_range):.0f}",
    )


def _listed(hz: FloatArray) -> str:
    """Frequencies in ascending order."""
    return ", ".join(f"{f:.3f}" for f in np.sort(hz)) or "none"
