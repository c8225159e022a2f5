"""Legends lie on no curve and on no title."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from romgen.forced_validation import ForcedPoint
from romgen.report import Reconstruction, ReportInputs
from romgen.report.forced_points import forced_points_figure
from romgen.report.history_figures import history_figure
from romgen.report.ringdown_figures import energy_figure, ringdown_figure
from romgen.report.style import house_style
from romgen.trajectory import Trajectory


def is_free(figure: Figure) -> bool:
    """No legend overlaps a frame or a title."""
    figure.canvas.draw()
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend() is not None)]
    taken = [axes.get_window_extent() for axes in figure.axes]
    taken += [axes.title.get_window_extent() for axes in figure.axes]
    taken += [axes._left_title.get_window_extent() for axes in figure.axes]  # type: ignore[attr-defined]
    assert legends
    boxes = [legend.get_tightbbox() for legend in legends]
    frames = [box.shrunk(0.98, 0.98) for box in taken if box.width > 0]
    return not any(box.shrunk(0.95, 0.9).overlaps(frame) for box in boxes for frame in frames)


def forced_point(level: float) -> ForcedPoint:
    t = np.arange(0.0, 0.3, 1e-4)
    x = 1e-3 * np.cos(2.0 * np.pi * 109.0 * t)
    return ForcedPoint(level, "m/s2", 109.0, "mid", "sqrt2_rms", 1e-3, 1e-3, 1.0, 0.1, "base_acceleration", t, x, x)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_forced_points(count: int) -> None:
    with house_style():
        assert is_free(forced_points_figure(tuple(forced_point(100.0 + k) for k in range(count))).figure)


def test_ring_down_with_six_sensors() -> None:
    names = ("accelerometer 1", "accelerometer 2", "tip left", "tip right", "mid span", "support")
    t = np.arange(0.0, 0.5, 1e-3)
    x = np.outer(np.exp(-4.0 * t) * np.cos(300.0 * t), np.linspace(0.5, 1.0, 6))
    pair = Reconstruction(Trajectory("first bending", t, names, x), 1.1 * x, 3.0, "validation")
    with house_style():
        assert is_free(ringdown_figure(pair).figure)


def test_figures_of_a_study(full_inputs: ReportInputs) -> None:
    with house_style():
        assert is_free(ringdown_figure(full_inputs.reconstructions[0]).figure)
        assert is_free(energy_figure(full_inputs.ring_downs[0]).figure)
        assert full_inputs.histories is not None
        assert is_free(history_figure(full_inputs.histories).figure)
