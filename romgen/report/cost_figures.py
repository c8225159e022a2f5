"""Where the time and the memory of a run go."""

from __future__ import annotations

import numpy as np

from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import curve_table
from romgen.report.inputs import StageCost
from romgen.report.style import BLUE, GREEN, label, new_figure


def cost_figure(stages: tuple[StageCost, ...]) -> FigureBlock:
    """Wall time and peak memory of every stage as bars, in running order."""
    figure = new_figure(0.9 + 0.28 * len(stages))
    left, right = figure.subplots(1, 2, sharey=True)
    place = np.arange(len(stages))
    wall = np.array([stage.wall_s for stage in stages])
    memory = np.array([stage.peak_memory_bytes for stage in stages], dtype=float)
    left.barh(place, wall, color=BLUE, height=0.65)
    right.barh(place, memory / 2**20, color=GREEN, height=0.65)
    left.set_yticks(place, [stage.name for stage in stages])
    left.invert_yaxis()
    for axes in (left, right):
        axes.grid(visible=False, axis="y")
    for y, value in enumerate(wall):
        left.annotate(f" {value:.2f}", (value, y), va="center", fontsize=8)
    label(left, "wall time [s]", "", "time")
    label(right, "peak memory of the process [MiB]", "", "memory")
    left.margins(x=0.15)
    table = curve_table(
        "stage_cost", ("stage", "running number", place + 1), ("wall time", "s", wall), ("peak memory", "byte", memory)
    )
    slowest = stages[int(np.argmax(wall))]
    caption = (
        f"Cost of every stage as measured: {wall.sum():.1f} s in all, most of it in “{slowest.name}” "
        f"({100.0 * slowest.wall_s / max(wall.sum(), 1e-12):.0f} %). "
        "Stages taken from an earlier run show what they cost then."
    )
    return FigureBlock("stage_cost", figure, caption, (table,))


def cost_table(stages: tuple[StageCost, ...]) -> TableBlock:
    """The same numbers as text."""
    total = sum(stage.wall_s for stage in stages)
    rows = tuple(
        (
            stage.name,
            f"{stage.wall_s:.3f}",
            f"{100.0 * stage.wall_s / max(total, 1e-12):.1f}",
            f"{stage.peak_memory_bytes / 2**20:.0f}",
        )
        for stage in stages
    )
    return TableBlock("Time and memory per stage.", ("stage", "wall time [s]", "share [%]", "peak memory [MiB]"), rows)
