"""What a section of the report is made of: figures with their data, tables, text, listings."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure

from romgen.report.curve_table import CurveTable
from romgen.report.style import ImageFormat


@dataclass(frozen=True)
class FigureBlock:
    """A drawn figure and the numbers behind every curve in it.

    Attributes
    ----------
    name : stem of the image file, unique in the report.
    figure : the matplotlib figure.
    caption : what to look at, and the conventions of sign and amplitude.
    tables : the drawn data; each becomes a CSV file.
    image_format : "svg" for lines, "png" for pictures and maps.
    """

    name: str
    figure: Figure
    caption: str
    tables: tuple[CurveTable, ...]
    image_format: ImageFormat = "svg"


@dataclass(frozen=True)
class TableBlock:
    """A table of text cells; numbers align right, ``words`` aligns all cells left."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: bool = False


@dataclass(frozen=True)
class TextBlock:
    """One paragraph."""

    text: str


@dataclass(frozen=True)
class ListingBlock:
    """Text shown as typed: commands, the printed normal form; a folded one opens on request."""

    caption: str
    text: str
    folded: bool = False


Block = FigureBlock | TableBlock | TextBlock | ListingBlock


@dataclass(frozen=True)
class Section:
    """One stage of the study in the report; ``anchor`` is its place in the table of contents."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Card:
    """A headline number: value, unit, what it is, its limit in words, and whether it is met (None: no limit)."""

    label: str
    value: str
    unit: str
    note: str
    passed: bool | None = None
