"""One look for all figures: sizes, fonts, colour-blind safe colours, and the way to open and save a figure."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ImageFormat = Literal["svg", "png"]

# Okabe and Ito 2008: distinguishable with every common colour-vision deficiency.
BLACK, ORANGE, SKY, GREEN = "#222222", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#8A8F98"
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
SHADE = "#EEF1F5"

SEQUENTIAL = "viridis"
DIVERGING = "RdBu_r"

FULL_WIDTH_IN = 9.0

PARAMETERS = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.labelcolor": "#30343B",
    "axes.edgecolor": "#9AA1AC",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "grid.color": "#E3E6EB",
    "grid.linewidth": 0.7,
    "xtick.color": "#5A616B",
    "ytick.color": "#5A616B",
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "romgen",
    "path.simplify_threshold": 0.3,
}


@contextmanager
def house_style() -> Iterator[None]:
    """The house parameters for the figures made and saved inside the block; global matplotlib state is restored."""
    with matplotlib.rc_context(PARAMETERS):
        yield


def new_figure(height_in: float, width_in: float = FULL_WIDTH_IN) -> Figure:
    """An empty figure of the given size in inches that draws without any window system."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def legend_above(axes: Axes) -> None:
    """The legend beside the title, above the frame, where it lies on no curve; at most six names in a row."""
    count = len(axes.get_legend_handles_labels()[1])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=min(count, 6), columnspacing=1.2, handlelength=1.4)


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Name both axes, units included (``"time [s]"``), and the panel."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title)


def unit_text(unit: str) -> str:
    """A unit as printed: the FMI spelling m/s2 becomes m/s²."""
    return unit.replace("2", "²").replace("3", "³")


def no_grid(axes: Axes) -> None:
    """Maps and pictures carry no grid lines and a full frame."""
    axes.grid(visible=False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)


def image_bytes(figure: Figure, image_format: ImageFormat) -> bytes:
    """The figure as a file image, without time stamps so that equal data give equal bytes."""
    target = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if image_format == "svg" else {"Software": None}
    figure.savefig(target, format=image_format, dpi=160, metadata=metadata)
    return target.getvalue()
