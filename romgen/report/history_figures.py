"""Load histories in the reduced and in the finite-element model: table and time histories."""

from __future__ import annotations

from romgen.load_histories import HistoryComparison
from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import curve_table
from romgen.report.style import BLACK, VERMILLION, label, legend_above, new_figure, unit_text


def history_table(histories: tuple[HistoryComparison, ...]) -> TableBlock:
    """Error and peaks of every history."""
    rows = tuple(
        (
            item.name,
            f"{item.input.replace('_', ' ')} [{unit_text(item.unit)}]",
            f"{1e3 * item.rom_peak_m:.4f}",
            f"{1e3 * item.fe_peak_m:.4f}",
            f"{item.nmte_percent:.2f}",
            f"{100.0 * item.range_share:.0f}",
        )
        for item in histories
    )
    caption = (
        "Both models start at rest under the same load. NMTE: mean distance of all sensors over the largest "
        "displacement. Range: largest modal amplitude over that in training; above 100 % the model extrapolates."
    )
    header = ("history", "input", "peak reduced [mm]", "peak finite elements [mm]", "NMTE [%]", "range [%]")
    return TableBlock(caption, header, rows)


def history_figure(histories: tuple[HistoryComparison, ...]) -> FigureBlock:
    """The first sensor under every history in both models."""
    figure = new_figure(1.9 * len(histories) + 0.3)
    grid = figure.subplots(len(histories), 1, squeeze=False).ravel()
    for axes, item in zip(grid, histories, strict=True):
        axes.plot(item.t, 1e3 * item.fe[:, 0], color=BLACK, label="finite elements")
        axes.plot(item.t, 1e3 * item.rom[:, 0], "--", color=VERMILLION, label="reduced model")
        label(axes, "time [s]", f"{item.sensors[0]} [mm]", item.name)
    legend_above(grid[0])
    tables = tuple(
        curve_table(
            f"load_history_{item.name}",
            ("time", "s", item.t),
            (item.input, item.unit, item.load),
            *((f"{name} finite elements", "m", item.fe[:, k]) for k, name in enumerate(item.sensors)),
            *((f"{name} reduced model", "m", item.rom[:, k]) for k, name in enumerate(item.sensors)),
        )
        for item in histories
    )
    return FigureBlock("load_histories", figure, "Motion under the load histories in both models.", tables)
