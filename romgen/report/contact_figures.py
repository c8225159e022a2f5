"""Contact pressure, gap and status of the interfaces, and the convergence of the preload."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.spatial import cKDTree

from romgen.arrays import FloatArray, IntArray
from romgen.report.blocks import FigureBlock, TableBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.style import BLUE, DIVERGING, SEQUENTIAL, VERMILLION, label, new_figure, no_grid
from romgen.structure import Interface, Preload

STATUS_NAMES = ("open", "stick", "slip")
_STATUS_COLOURS = ("#D9DCE2", BLUE, VERMILLION)
# Hole and edge peaks would wash the map out: the colour scale ends here and the caption says so.
_CAP_PERCENTILE = 98.0
_PIXELS = 400


def plane_axes(points: FloatArray) -> tuple[int, int]:
    """The two coordinate directions in which the points spread most, ascending."""
    first, second = sorted(np.argsort(np.ptp(points, axis=0))[-2:].tolist())
    return first, second


@dataclass(frozen=True)
class _NearestPoint:
    """Which integration point is nearest to every pixel of the plane of an interface, -1 far from all of them."""

    index: IntArray
    extent_mm: tuple[float, float, float, float]
    plane: tuple[int, int]


def _nearest_point(interface: Interface) -> _NearestPoint:
    """Pixels belong to the nearest point, but not beyond twice the width of its integration area (stretched facets)."""
    plane = plane_axes(interface.points)
    flat, width = interface.points[:, plane], np.sqrt(interface.area)
    low, high = flat.min(axis=0) - 0.4 * width.min(), flat.max(axis=0) + 0.4 * width.min()
    pixel = (high - low).max() / _PIXELS
    x, y = (np.arange(low[k] + 0.5 * pixel, high[k], pixel) for k in range(2))
    distance, index = cKDTree(flat).query(np.stack(np.meshgrid(x, y), axis=-1))
    near = np.where(distance <= 2.0 * width[index], index, -1)
    edges = 1e3 * np.array([low[0], low[0] + x.size * pixel, low[1], low[1] + y.size * pixel])
    return _NearestPoint(near, tuple(edges.tolist()), plane)


def _map(
    axes: Axes, seen: _NearestPoint, values: FloatArray, colour_map: Colormap, span: tuple[float, float]
) -> AxesImage:
    """Colour every pixel by the value of its integration point."""
    picture = np.ma.masked_where(seen.index < 0, values[seen.index])
    low, high = span
    image = axes.imshow(
        picture, origin="lower", extent=seen.extent_mm, cmap=colour_map, vmin=low, vmax=high, interpolation="nearest"
    )
    label(axes, *(f"{'xyz'[direction]} [mm]" for direction in seen.plane))
    no_grid(axes)
    return image


def _draw_row(figure: Figure, row: tuple[Axes, Axes, Axes], interface: Interface, cap_mpa: float) -> None:
    """Pressure, gap and status of one interface side by side."""
    seen = _nearest_point(interface)
    pressure = _map(row[0], seen, 1e-6 * interface.pressure, matplotlib.colormaps[SEQUENTIAL], (0.0, cap_mpa))
    largest = max(1e6 * float(np.abs(interface.gap).max()), 1e-6)
    gap = _map(row[1], seen, 1e6 * interface.gap, matplotlib.colormaps[DIVERGING], (-largest, largest))
    _map(row[2], seen, interface.status.astype(float), ListedColormap(_STATUS_COLOURS), (-0.5, 2.5))
    figure.colorbar(pressure, ax=row[0], label="pressure [MPa]", extend="max", shrink=0.85)
    figure.colorbar(gap, ax=row[1], label="gap [µm]", shrink=0.85)
    row[0].set_title(f"{interface.name}: pressure")
    row[1].set_title("gap (penetration < 0)")
    row[2].set_title("status")


def _interface_table(interface: Interface) -> CurveTable:
    """The state of one interface at its integration points."""
    p = interface.points
    return curve_table(
        f"interface_{interface.name}",
        *((axis, "m", p[:, k]) for k, axis in enumerate("xyz")),
        ("area", "m^2", interface.area),
        ("pressure", "Pa", interface.pressure),
        ("traction 1", "Pa", interface.traction[:, 0]),
        ("traction 2", "Pa", interface.traction[:, 1]),
        ("gap", "m", interface.gap),
        ("status", "0 open 1 stick 2 slip", interface.status),
    )


def contact_figure(preload: Preload) -> FigureBlock:
    """Maps of pressure, gap and status, one row per interface."""
    interfaces = preload.interfaces
    height = sum(_row_height(interface) for interface in interfaces) + 0.4
    figure = new_figure(height)
    cap = max(1e-6 * float(np.percentile(np.concatenate([i.pressure for i in interfaces]), _CAP_PERCENTILE)), 1e-6)
    grid = figure.subplots(len(interfaces), 3, squeeze=False)
    for row, interface in zip(grid, interfaces, strict=True):
        _draw_row(figure, tuple(row), interface, cap)
    handles = [Patch(facecolor=c, label=n) for n, c in zip(STATUS_NAMES, _STATUS_COLOURS, strict=True)]
    figure.legend(handles=handles, loc="outside lower right", ncols=3)
    peak = 1e-6 * max(float(i.pressure.max()) for i in interfaces)
    caption = (
        "State of the frictional interfaces after preload. Every spot shows its nearest integration point. "
        f"Compression is positive; the pressure scale ends at {cap:.1f} MPa "
        f"({_CAP_PERCENTILE:.0f} % of the points lie below), the peak is {peak:.1f} MPa. Open zones and slip at the "
        "edge of the clamping are where damping and amplitude dependence come from."
    )
    return FigureBlock("contact", figure, caption, tuple(_interface_table(i) for i in interfaces), "png")


def _row_height(interface: Interface) -> float:
    """Height in inches that shows the interface undistorted at a third of the page width."""
    plane = plane_axes(interface.points)
    spread = np.ptp(interface.points[:, plane], axis=0)
    return float(np.clip(1.7 * spread[1] / max(spread[0], 1e-12), 1.2, 3.4)) + 0.7


def convergence_figure(preload: Preload) -> FigureBlock:
    """Relative residual of all Newton iterations of the preload, and the load factor of its steps."""
    figure = new_figure(2.6)
    left, right = figure.subplots(1, 2, width_ratios=(2, 1))
    iteration = np.arange(1, preload.residuals.size + 1)
    left.semilogy(iteration, preload.residuals, "o-", color=BLUE, markersize=3.5)
    label(left, "Newton iteration, all load steps [1]", "relative residual [1]", "residual")
    right.xaxis.set_major_locator(MaxNLocator(integer=True))
    step = np.arange(1, preload.load_factors.size + 1)
    right.plot(step, preload.load_factors, "o-", color=VERMILLION, markersize=4)
    right.set_ylim(bottom=0.0)
    label(right, "load step [1]", "load factor [1]", "load steps")
    tables = (
        curve_table("preload_residuals", ("iteration", "1", iteration), ("residual", "1", preload.residuals)),
        curve_table("preload_load_factors", ("step", "1", step), ("load factor", "1", preload.load_factors)),
    )
    caption = (
        "Convergence of the static preload. Each load step starts with a jump; within it the residual "
        "should fall ever faster, and a plateau points to contact that chatters between open and closed."
    )
    return FigureBlock("preload_convergence", figure, caption, tables)


def resultant_table(preload: Preload) -> TableBlock:
    """Resultant against applied force, contact area, penetration and peak pressure of every interface."""
    rows = tuple(_resultant_row(interface) for interface in preload.interfaces)
    header = (
        "interface",
        "contact force [N]",
        "applied force [N]",
        "difference [%]",
        "contact area [mm²]",
        "closed [%]",
        "slipping [%]",
        "largest penetration [µm]",
        "peak pressure [MPa]",
    )
    return TableBlock("Equilibrium of the interfaces: the contact force must equal what the loads apply.", header, rows)


def _resultant_row(interface: Interface) -> tuple[str, ...]:
    """Text cells of one interface."""
    applied, area = interface.applied_force_n, interface.area.sum()
    known = np.isfinite(applied) and applied != 0.0
    closed, slip = interface.status > 0, interface.status == 2
    return (
        interface.name,
        f"{interface.normal_force_n:,.1f}",
        f"{applied:,.1f}" if np.isfinite(applied) else "not determined",
        f"{100.0 * (interface.normal_force_n / applied - 1.0):+.4f}" if known else "n/a",
        f"{1e6 * interface.contact_area_m2:,.1f}",
        f"{100.0 * interface.area[closed].sum() / area:.1f}",
        f"{100.0 * interface.area[slip].sum() / area:.1f}",
        f"{1e6 * max(-interface.gap.min(), 0.0):.3f}",
        f"{1e-6 * interface.pressure.max():.2f}",
    )
