"""Forced points in the reduced and in the finite-element model: table and time histories."""

from __future__ import annotations

from romgen.forced_validation import MEASURED_PERIODS, ForcedPoint
from romgen.report.backbone_figures import MEASURE_NAMES
from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import curve_table
from romgen.report.style import BLACK, VERMILLION, label, new_figure, unit_text

_SHOWN_PERIODS = 6.0


def forced_points_table(points: tuple[ForcedPoint, ...]) -> TableBlock:
    """Amplitude of every point in both models."""
    rows = tuple(
        (
            f"{point.load:g} {unit_text(point.unit)}",
            f"{point.frequency_hz:.3f}",
            f"{1e3 * point.rom_m:.4f}",
            f"{1e3 * point.fe_m:.4f}",
            f"{point.error_percent:+.2f}",
            f"{point.drift_percent:+.2f}",
        )
        for point in points
    )
    first = points[0]
    caption = (
        f"{MEASURE_NAMES[first.measure]} of sensor “{first.sensor}” over the last {MEASURED_PERIODS} periods. Both "
        "models start on the orbit of the reduced model and are forced for the same time. Drift: how much the "
        "amplitude of the finite-element model still changed over the second half; where it is not small, its own "
        "orbit lies further off."
    )
    header = (
        first.input.replace("_", " "),
        "frequency [Hz]",
        "reduced [mm]",
        "finite elements [mm]",
        "error [%]",
        "drift [%]",
    )
    return TableBlock(caption, header, rows)


def forced_points_figure(points: tuple[ForcedPoint, ...]) -> FigureBlock:
    """Last periods of every point in both models."""
    columns = 2 if len(points) > 1 else 1
    count = -(-len(points) // columns)
    figure = new_figure(1.9 * count + 0.5)
    grid = figure.subplots(count, columns, squeeze=False).ravel()
    for axes, point in zip(grid, points, strict=False):
        shown = point.t >= point.t[-1] - _SHOWN_PERIODS / point.frequency_hz
        axes.plot(point.t[shown], 1e3 * point.fe[shown], color=BLACK, label="finite elements")
        axes.plot(point.t[shown], 1e3 * point.rom[shown], "--", color=VERMILLION, label="reduced model")
        title = f"{point.load:g} {unit_text(point.unit)}, {point.frequency_hz:.2f} Hz"
        label(axes, "time [s]", f"{point.sensor} [mm]", title)
    for axes in grid[len(points) :]:
        axes.set_axis_off()
    figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    tables = tuple(
        curve_table(
            f"forced_point_{number}",
            ("time", "s", point.t),
            (f"{point.sensor} finite elements", "m", point.fe),
            (f"{point.sensor} reduced model", "m", point.rom),
        )
        for number, point in enumerate(points, 1)
    )
    caption = "Last periods of the forced motions in both models, under the same load from the same start."
    return FigureBlock("forced_points", figure, caption, tables)
