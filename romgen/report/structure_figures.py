"""Pictures of the mesh and of its modes."""

from __future__ import annotations

from collections.abc import Callable

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba
from matplotlib.patches import Patch

from romgen.arrays import FloatArray, IntArray
from romgen.report.blocks import FigureBlock
from romgen.report.curve_table import CurveTable, curve_table
from romgen.report.raster import Raster
from romgen.report.skin import draw_skin, draw_triad, triangle_body, view_frame
from romgen.report.style import DIVERGING, FULL_WIDTH_IN, new_figure
from romgen.structure import Modes, Structure

# Soft tints, one per body, in the order blue, amber, green, pink, grey.
_BODY_COLOURS = ("#8DBBE0", "#F3CB7D", "#8BCDB5", "#E2B4CE", "#C3C8D0")
SHOWN_MODES = 4
_WIDTH_PX = 950
_UNIT_RANGE = Normalize(-1.0, 1.0)
# Largest drawn modal displacement as a fraction of the model's length.
_DRAWN_AMPLITUDE = 0.1


def _picture_height_in(structure: Structure, points: FloatArray, width_in: float) -> float:
    """Height of the projected model when it fills the given width, within bounds that suit a page."""
    seen = points @ view_frame(structure.points).T
    spread = np.ptp(seen[:, :2], axis=0)
    return float(np.clip(width_in * spread[1] / spread[0], 1.2, 6.0))


def mesh_figure(structure: Structure) -> FigureBlock:
    """The mesh, one colour per body."""
    figure = new_figure(_picture_height_in(structure, structure.points, FULL_WIDTH_IN) + 0.4)
    axes = figure.add_subplot()
    body = triangle_body(structure)
    palette = np.array([to_rgba(_BODY_COLOURS[k % len(_BODY_COLOURS)]) for k in range(len(structure.bodies))])
    draw_skin(axes, structure, structure.points, lambda raster: palette[body[raster.triangle], :3], 2 * _WIDTH_PX)
    draw_triad(axes, structure.points)
    handles = [Patch(facecolor=tuple(palette[k]), label=name) for k, name in enumerate(structure.bodies)]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
    nodes = np.unique(structure.skin)
    p = structure.points[nodes]
    columns = [(name, "m", p[:, k]) for k, name in enumerate("xyz")]
    caption = (
        "Outer surface of the finite-element mesh as modelled, one colour per body, true to scale. A half model with a "
        "symmetry plane shows one half only."
    )
    return FigureBlock("mesh", figure, caption, (curve_table("mesh_skin", ("node", "1", nodes), *columns),), "png")


def unit_shape(modes: Modes, k: int) -> FloatArray:
    """Mode k at the nodes, (n_node, 3), largest displacement 1, its largest component positive."""
    shape: FloatArray = modes.shapes[:, k].reshape(-1, 3)
    largest = shape.ravel()[np.argmax(np.abs(shape))]
    unit: FloatArray = shape * np.sign(largest) / np.linalg.norm(shape, axis=1).max()
    return unit


def transverse_direction(modes: Modes) -> int:
    """Direction 0, 1, 2 in which the shown modes move most; for a panel its normal."""
    shapes = modes.shapes[:, :SHOWN_MODES].reshape(-1, 3, min(SHOWN_MODES, modes.shapes.shape[1]))
    return int(np.argmax(np.einsum("ndm,ndm->d", shapes, shapes)))


def _field_colouring(structure: Structure, nodal: FloatArray) -> Callable[[Raster], FloatArray]:
    """Colours of a field given at the nodes, (n_node,) in -1..1, linear over each triangle."""

    def colours(raster: Raster) -> FloatArray:
        values = np.einsum("rck,rck->rc", raster.weights, nodal[structure.skin[raster.triangle]])
        coloured: FloatArray = matplotlib.colormaps[DIVERGING](_UNIT_RANGE(values))[:, :, :3]
        return coloured

    return colours


def mode_figure(structure: Structure, modes: Modes) -> FigureBlock:
    """The first modes on the deformed skin, coloured by the transverse displacement."""
    shapes = [unit_shape(modes, k) for k in range(min(SHOWN_MODES, modes.frequency_hz.size))]
    size = _DRAWN_AMPLITUDE * np.ptp(structure.points, axis=0).max()
    deformed = [structure.points + size * shape for shape in shapes]
    rows, direction = (len(shapes) + 1) // 2, transverse_direction(modes)
    height = max(_picture_height_in(structure, points, 0.46 * FULL_WIDTH_IN) for points in deformed)
    figure = new_figure(rows * (height + 0.25))
    grid = figure.subplots(rows, 2, squeeze=False)
    for k, (axes, points, shape) in enumerate(zip(grid.flat, deformed, shapes, strict=False)):
        draw_skin(axes, structure, points, _field_colouring(structure, shape[:, direction]), _WIDTH_PX)
        axes.set_title(f"mode {k + 1}: {modes.frequency_hz[k]:.2f} Hz")
    for axes in grid.flat[len(shapes) :]:
        axes.set_axis_off()
    bar = figure.colorbar(ScalarMappable(_UNIT_RANGE, DIVERGING), ax=grid, shrink=0.7, aspect=28, location="right")
    bar.set_label(f"{'xyz'[direction]} displacement / largest [1]")
    caption = (
        f"Mode shapes of the preloaded structure with stuck contact on the deformed skin; colour is the "
        f"{'xyz'[direction]} displacement. Each shape is drawn with its largest displacement at "
        f"{100 * _DRAWN_AMPLITUDE:.0f} % of the model length; the sign of a mode is arbitrary."
    )
    return FigureBlock("modes", figure, caption, (_mode_table(np.unique(structure.skin), shapes),), "png")


def _mode_table(nodes: IntArray, shapes: list[FloatArray]) -> CurveTable:
    """Drawn displacement of the skin nodes, three components per mode."""
    columns = [
        (f"mode {k + 1} {name}", "1", shape[nodes, c]) for k, shape in enumerate(shapes) for c, name in enumerate("xyz")
    ]
    return curve_table("mode_shapes_skin", ("node", "1", nodes), *columns)
