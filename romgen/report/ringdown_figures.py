"""Recorded motion against the reduced model, sensor by sensor and in energies."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from romgen.arrays import FloatArray
from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.inputs import Reconstruction
from romgen.report.style import BLACK, BLUE, CYCLE, GREEN, ORANGE, VERMILLION, label, legend_above, new_figure
from romgen.structure import RingDown

_ZOOM_CYCLES = 10


def cycle_s(t: FloatArray, x: FloatArray) -> float:
    """Mean time between upward zero crossings of x in s; the whole record where there are fewer than two."""
    upward = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    return float(t[-1] - t[0]) if upward.size < 2 else float((t[upward[-1]] - t[upward[0]]) / (upward.size - 1))


def _draw_both(axes: Axes, pair: Reconstruction, rows: slice) -> None:
    """Recorded and reduced displacement of the main sensor over the chosen samples."""
    k, t = pair.main_sensor, pair.trajectory.t
    axes.plot(t[rows], 1e3 * pair.trajectory.displacement[rows, k], color=BLACK, linewidth=1.1, label="reference")
    axes.plot(t[rows], 1e3 * pair.displacement[rows, k], "--", color=VERMILLION, linewidth=1.1, label="reduced model")


def _draw_error(axes: Axes, pair: Reconstruction) -> None:
    """Error of every sensor relative to the largest recorded displacement of that sensor."""
    peak = np.abs(pair.trajectory.displacement).max(axis=0)
    error = 100.0 * (pair.displacement - pair.trajectory.displacement) / np.where(peak > 0.0, peak, 1.0)
    for k, name in enumerate(pair.trajectory.sensors):
        axes.plot(pair.trajectory.t, error[:, k], color=CYCLE[k % len(CYCLE)], linewidth=0.7, label=name)
    legend_above(axes)
    label(axes, "time [s]", "error / peak [%]", "error of every sensor")


def ringdown_figure(pair: Reconstruction) -> FigureBlock:
    """Full record, error, first cycles and tail of one motion."""
    figure = new_figure(5.6)
    places: dict[str, Axes] = figure.subplot_mosaic(
        [["all", "all"], ["error", "error"], ["first", "tail"]], height_ratios=(1.2, 1, 1.1)
    )
    k, t = pair.main_sensor, pair.trajectory.t
    sensor = pair.trajectory.sensors[k]
    _draw_both(places["all"], pair, slice(None))
    legend_above(places["all"])
    label(places["all"], "time [s]", f"{sensor} [mm]", f"{pair.trajectory.name} ({pair.role})")
    _draw_error(places["error"], pair)
    zoom = _ZOOM_CYCLES * cycle_s(t, pair.trajectory.displacement[:, k])
    first = slice(0, int(np.searchsorted(t, t[0] + zoom)) + 1)
    tail = slice(int(np.searchsorted(t, t[-1] - zoom)), None)
    for name, rows, title in (("first", first, "first cycles"), ("tail", tail, "last cycles")):
        _draw_both(places[name], pair, rows)
        label(places[name], "time [s]", f"{sensor} [mm]", title)
    caption = (
        f"{pair.trajectory.name}: displacement of sensor “{sensor}” from the rest state, recorded (solid) and "
        f"by the reduced model from the same initial state (dashed). NMTE {pair.nmte_percent:.2f} %. "
        "The last cycles show phase drift, which dominates the error of a good model."
    )
    return FigureBlock(f"ringdown_{pair.trajectory.name}", figure, caption, (_ringdown_table(pair),))


def _ringdown_table(pair: Reconstruction) -> CurveTable:
    """Time and every sensor, recorded and reduced."""
    recorded = [
        (f"{name} reference", "m", pair.trajectory.displacement[:, k]) for k, name in enumerate(pair.trajectory.sensors)
    ]
    reduced = [
        (f"{name} reduced model", "m", pair.displacement[:, k]) for k, name in enumerate(pair.trajectory.sensors)
    ]
    return curve_table(f"ringdown_{pair.trajectory.name}", ("time", "s", pair.trajectory.t), *recorded, *reduced)


def nmte_table(pairs: tuple[Reconstruction, ...]) -> TableBlock:
    """Error of every motion, training and validation apart, with the extent of the data."""
    rows = tuple(
        (
            pair.trajectory.name,
            pair.role,
            f"{pair.nmte_percent:.3f}",
            f"{1e3 * np.abs(pair.trajectory.displacement).max():.3f}",
            f"{pair.trajectory.t[-1] - pair.trajectory.t[0]:.3f}",
            f"{pair.trajectory.t.size}",
        )
        for pair in sorted(pairs, key=lambda pair: pair.role)
    )
    caption = (
        "NMTE = 100 · mean over time of |x - x_ROM| / largest |x|. Validation motions were never seen by "
        "the fit; judge the model by those rows."
    )
    header = ("trajectory", "role", "NMTE [%]", "peak displacement [mm]", "length [s]", "samples")
    return TableBlock(caption, header, rows)


def energy_figure(ring_down: RingDown) -> FigureBlock:
    """Stored and dissipated energy of one transient, and what the time integration gains or loses."""
    t, ledger, name = ring_down.trajectory.t, ring_down.energy, ring_down.trajectory.name
    stored = ledger.kinetic + ledger.strain + ledger.contact
    budget = stored[0] + ledger.external
    figure = new_figure(3.9)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1))
    parts = (
        ("material damping", ledger.damping, GREEN),
        ("friction", ledger.friction, ORANGE),
        ("stored", stored, BLUE),
    )
    _draw_stack(top, t, parts)
    top.plot(t, 1e3 * budget, color=BLACK, linewidth=1.0, linestyle="--", label="initial + external work")
    legend_above(top)
    label(top, "", "energy [mJ]", name)
    percent = 100.0 * ledger.imbalance / np.abs(budget).max()
    bottom.plot(t, percent, color=VERMILLION, linewidth=0.9)
    label(
        bottom,
        "time [s]",
        "imbalance [%]",
        "energy made (> 0) or lost (< 0) by the time integration, relative to the budget",
    )
    columns = ("kinetic", "strain", "contact", "friction", "damping", "external", "imbalance")
    table = curve_table(f"energy_{name}", ("time", "s", t), *((c, "J", getattr(ledger, c)) for c in columns))
    caption = (
        f"{name}: energy dissipated since the start (friction in the joint, Rayleigh damping) under what is "
        "still stored (kinetic + strain + contact, relative to rest). The upper edge should lie on the dashed budget; "
        f"the largest imbalance is {np.abs(percent).max():.2g} %."
    )
    return FigureBlock(f"energy_{name}", figure, caption, (table,), "png")


def _draw_stack(axes: Axes, t: FloatArray, parts: tuple[tuple[str, FloatArray, str], ...]) -> None:
    """Areas on top of each other in mJ."""
    base = np.zeros_like(t)
    for name, energy, colour in parts:
        axes.fill_between(t, 1e3 * base, 1e3 * (base + energy), color=colour, alpha=0.75, linewidth=0.0, label=name)
        base = base + energy


def energy_table(ring_downs: tuple[RingDown, ...]) -> TableBlock:
    """Initial energy, shares dissipated, and imbalance of every transient."""
    rows = tuple(_energy_row(ring_down) for ring_down in ring_downs)
    header = (
        "trajectory",
        "initial energy [mJ]",
        "to friction [%]",
        "to damping [%]",
        "still stored [%]",
        "imbalance [%]",
        "iterations per step",
        "rejected steps",
    )
    return TableBlock("Energy balance at the end of every transient, in parts of the initial energy.", header, rows)


def _energy_row(ring_down: RingDown) -> tuple[str, ...]:
    """Text cells of one transient."""
    ledger = ring_down.energy
    stored = ledger.kinetic + ledger.strain + ledger.contact
    shares = 100.0 * np.array([ledger.friction[-1], ledger.damping[-1], stored[-1]]) / stored[0]
    return (
        ring_down.trajectory.name,
        f"{1e3 * stored[0]:.4g}",
        *(f"{share:.2f}" for share in shares),
        f"{100.0 * np.abs(ledger.imbalance).max() / stored[0]:.2g}",
        f"{ring_down.iterations[1:].mean():.2f}",
        str(ring_down.effort.rejected.sum()),
    )
