"""The lines in the figures are the columns of their tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from romgen.arrays import FloatArray
from romgen.confidence_band import confidence_band
from romgen.jackknife import Replicates
from romgen.report import ReportInputs
from romgen.report.backbone_figures import backbone_figure
from romgen.report.forced_figures import modal_figure, response_figure
from romgen.report.forcing_tables import calibration_table, load_table
from romgen.report.ringdown_figures import cycle_s, energy_figure, ringdown_figure
from romgen.report.style import house_style


def drawn(axes: Axes, x: FloatArray, y: FloatArray) -> bool:
    """Whether the lines of the axes, taken together, pass through all the points (x, y) and no others."""
    lines = [line.get_xydata() for line in axes.get_lines() if line.get_marker() in (None, "None", "")]
    points = {tuple(p) for line in lines for p in np.asarray(line, dtype=float) if np.isfinite(p).all()}
    return points == set(zip(x.tolist(), y.tolist(), strict=True))


def test_ring_down(full_inputs: ReportInputs) -> None:
    """The upper panel shows the main sensor in mm, recorded and reduced."""
    pair = full_inputs.reconstructions[2]
    with house_style():
        block = ringdown_figure(pair)
    (table,) = block.tables
    recorded, reduced = block.figure.axes[0].get_lines()
    np.testing.assert_array_equal(recorded.get_ydata(), 1e3 * table["corner reference"])
    np.testing.assert_array_equal(reduced.get_ydata(), 1e3 * table["corner reduced model"])
    np.testing.assert_array_equal(recorded.get_xdata(), table["time"])


def test_frequency_response_shows_every_point_of_every_branch(full_inputs: ReportInputs) -> None:
    """Stable and unstable pieces together are the curve; the dashed ones hold every unstable point."""
    response = full_inputs.forced
    assert response is not None
    with house_style():
        block = response_figure(response, ())
    x = np.concatenate([table["frequency"] for table in block.tables])
    y = 1e3 * np.concatenate([table["amplitude sqrt2_rms mid"] for table in block.tables])
    assert drawn(block.figure.axes[0], x, y)
    unstable = np.concatenate([table["stable"] == 0.0 for table in block.tables])
    assert unstable.any()
    dashed = [line.get_ydata() for line in block.figure.axes[0].get_lines() if line.get_linestyle() == "--"]
    assert set(y[unstable].tolist()) <= set(np.concatenate(dashed).tolist())


def test_modal_response(full_inputs: ReportInputs) -> None:
    """One panel per mode."""
    response, model = full_inputs.forced, full_inputs.model
    assert response is not None
    assert model is not None
    with house_style():
        block = modal_figure(response, model)
    for j, axes in enumerate(block.figure.axes):
        x = np.concatenate([table["frequency"] for table in block.tables])
        y = np.concatenate([table[f"abs z_{j + 1}"] for table in block.tables])
        assert drawn(axes, x, y)


def test_backbone(full_inputs: ReportInputs) -> None:
    """Frequency and damping in percent against the amplitude in mm, one row per mode."""
    with house_style():
        block = backbone_figure(full_inputs.backbones, None, "max")
    tables = {table.name: table for table in block.tables}
    assert set(tables) == {"backbone_mode1_alone", "backbone_mode1_locked", "backbone_mode2_alone"}
    second = tables["backbone_mode2_alone"]
    assert drawn(block.figure.axes[2], 1e3 * second["amplitude"], second["frequency"])
    assert drawn(block.figure.axes[3], 1e3 * second["amplitude"], 100.0 * second["damping ratio"])


def test_confidence_limits_are_drawn_and_written(full_inputs: ReportInputs) -> None:
    """One eigenvalue per replicate, 1 % apart: the deviation of the frequency is that of its eigenvalue."""
    model = full_inputs.model
    assert model is not None
    shares = np.array([0.99, 1.0, 1.01])
    nonlinear = np.repeat(model.normal_form.coefficients[None], 3, axis=0)
    replicates = Replicates(shares[:, None] * model.eigenvalues, nonlinear)
    curve = full_inputs.backbones[0]
    band = confidence_band(model, curve, replicates)
    with house_style():
        block = backbone_figure((curve,), None, "max", (band,))
    (table,) = block.tables
    half = table["frequency upper limit"] - table["frequency"]
    # jackknife: 2/3 (0.01^2 + 0.01^2) omega^2; two degrees of freedom: t = 4.3027
    expected = 4.302653 * np.sqrt(2.0 / 3.0 * 2e-4) * model.eigenvalues[0].imag / (2.0 * np.pi)
    np.testing.assert_allclose(half, expected, rtol=1e-6)
    np.testing.assert_allclose(table["frequency"] - table["frequency lower limit"], half, rtol=1e-6)
    path = block.figure.axes[0].collections[0].get_paths()[0].vertices
    assert path[:, 1].max() == pytest.approx(float(table["frequency upper limit"].max()))
    damping = block.figure.axes[1].collections[0].get_paths()[0].vertices
    assert damping[:, 1].max() == pytest.approx(100.0 * float(table["damping ratio upper limit"].max()))


def test_energy_stack_reaches_the_budget(full_inputs: ReportInputs) -> None:
    """The upper edge of the stack is what is stored and dissipated, in mJ."""
    with house_style():
        block = energy_figure(full_inputs.ring_downs[0])
    (table,) = block.tables
    total = sum(table[name] for name in ("kinetic", "strain", "contact", "friction", "damping"))
    top = block.figure.axes[0].collections[2].get_paths()[0].vertices[:, 1].max()
    assert top == pytest.approx(1e3 * float(np.max(total)))


def test_cycle_of_a_cosine() -> None:
    """Mean distance of upward zero crossings, to within one sample over the number of cycles."""
    t = np.linspace(0.0, 1.0, 5001)
    assert cycle_s(t, np.cos(2 * np.pi * 40.0 * t)) == pytest.approx(1 / 40.0, abs=2e-4 / 38)
    assert cycle_s(t, np.ones_like(t)) == pytest.approx(1.0)


def test_measured_points_lie_on_the_frequency_response(full_inputs: ReportInputs) -> None:
    """Only those of the drawn input, sensor, measure and level."""
    response, (base, hammer) = full_inputs.forced, full_inputs.loads
    assert response is not None
    point = base.points[0]
    others = (replace(point, level=3.0), replace(point, sensor="lower"), replace(point, measure="max"))
    with house_style():
        block = response_figure(response, (), (), (replace(base, points=(point, *others)), hammer))
    marked = [line.get_xydata() for line in block.figure.axes[0].get_lines() if line.get_marker() == "+"]
    np.testing.assert_allclose(np.concatenate(marked), [[point.frequency_hz, 1e3 * point.measured_m]])


def test_calibration_table_names_what_is_wrong_with_a_point(full_inputs: ReportInputs) -> None:
    base, hammer = full_inputs.loads
    row = calibration_table(base).rows[0]
    assert row[-1] == "peak of the response, outside the trained range, not stable"
    assert "none" in row  # no state of the model near the measurement at this level
    loads = load_table((base, hammer)).rows
    assert [cells[1] for cells in loads] == ["1 measured point", "given participation"]
    assert loads[0][3] == "2.8, -"
