"""Pictures of the mesh and of its modes."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba
from matplotlib.patches import Patch

from romgen.arrays import FloatArray
from romgen.report.blocks import FigureBlock
from romgen.report.curve_table import curve_table
from romgen.report.skin import draw_faces, draw_triad, node_body, skin_faces
from romgen.report.style import DIVERGING, new_figure
from romgen.structure import Modes, Structure

# Soft tints, one per body, in the order blue, amber, green, pink, grey.
_BODY_COLOURS = ("#7FB2D9", "#F0C26B", "#7CC6AC", "#DDA9C6", "#B9BEC7")
SHOWN_MODES = 4
# Largest drawn modal displacement as a fraction of the model's length.
_DRAWN_AMPLITUDE = 0.12


def mesh_figure(structure: Structure) -> FigureBlock:
    """The mesh, one colour per body."""
    figure = new_figure(3.6)
    axes = figure.add_subplot(projection="3d")
    faces = skin_faces(structure)
    body = node_body(structure)[faces].min(axis=1)
    palette = np.array([to_rgba(_BODY_COLOURS[k % len(_BODY_COLOURS)]) for k in range(len(structure.bodies))])
    draw_faces(axes, structure.points, faces, palette[body])
    draw_triad(axes, structure.points)
    handles = [Patch(facecolor=tuple(palette[k]), label=name) for k, name in enumerate(structure.bodies)]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    skin_nodes = np.unique(faces)
    p = structure.points[skin_nodes]
    table = curve_table(
        "mesh_skin_nodes", ("node", "1", skin_nodes), ("x", "m", p[:, 0]), ("y", "m", p[:, 1]), ("z", "m", p[:, 2])
    )
    caption = (
        "Outer surface of the finite-element mesh as modelled, one colour per body, axes to scale. A symmetric half "
        "model shows one half only."
    )
    return FigureBlock("mesh", figure, caption, (table,), "png")


def _unit_shape(modes: Modes, k: int) -> FloatArray:
    """Mode k at the nodes, (n_node, 3), largest displacement 1, its largest component positive."""
    shape: FloatArray = modes.shapes[:, k].reshape(-1, 3)
    largest = shape.ravel()[np.argmax(np.abs(shape))]
    unit: FloatArray = shape * np.sign(largest) / np.linalg.norm(shape, axis=1).max()
    return unit


def transverse_direction(modes: Modes) -> int:
    """Direction 0, 1, 2 in which the shown modes move most; for a panel its normal."""
    shapes = modes.shapes[:, :SHOWN_MODES].reshape(-1, 3, min(SHOWN_MODES, modes.shapes.shape[1]))
    return int(np.argmax(np.einsum("ndm,ndm->d", shapes, shapes)))


def mode_figure(structure: Structure, modes: Modes) -> FigureBlock:
    """The first modes on the deformed skin, coloured by the transverse displacement."""
    shown = min(SHOWN_MODES, modes.frequency_hz.size)
    rows = (shown + 1) // 2
    figure = new_figure(2.5 * rows + 0.6)
    faces, direction = skin_faces(structure), transverse_direction(modes)
    size = _DRAWN_AMPLITUDE * np.ptp(structure.points, axis=0).max()
    norm, colour_map = Normalize(-1.0, 1.0), matplotlib.colormaps[DIVERGING]
    nodes, columns, grid = np.unique(faces), [], []
    for k in range(shown):
        axes = figure.add_subplot(rows, 2, k + 1, projection="3d")
        shape = _unit_shape(modes, k)
        value = shape[faces, direction].mean(axis=1)
        draw_faces(axes, structure.points + size * shape, faces, colour_map(norm(value)), edge="#00000018")
        axes.set_title(f"mode {k + 1}: {modes.frequency_hz[k]:.2f} Hz", y=0.92)
        columns += [(f"mode {k + 1} {'xyz'[c]}", "1", shape[nodes, c]) for c in range(3)]
        grid.append(axes)
    bar = figure.colorbar(ScalarMappable(norm, colour_map), ax=grid, shrink=0.55, aspect=28, location="right")
    bar.set_label(f"{'xyz'[direction]} displacement / largest displacement [1]")
    caption = (
        f"Mode shapes of the preloaded structure with stuck contact on the deformed skin; colour is the "
        f"{'xyz'[direction]} displacement. Each shape is drawn with its largest displacement at "
        f"{100 * _DRAWN_AMPLITUDE:.0f} % of the model length; the sign of a mode is arbitrary."
    )
    return FigureBlock(
        "modes", figure, caption, (curve_table("mode_shapes_skin", ("node", "1", nodes), *columns),), "png"
    )
