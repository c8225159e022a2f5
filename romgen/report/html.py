"""The single-file HTML page: template, style sheet, inlined pictures."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import romgen
from romgen.report.blocks import Block, Card, FigureBlock, ListingBlock, Section, TableBlock

_MEDIA = {"svg": "image/svg+xml", "png": "image/png"}


@dataclass(frozen=True)
class SavedFigure:
    """File image of a figure and where it and its data lie, relative to the report."""

    image: bytes
    files: tuple[str, ...]


@dataclass(frozen=True)
class Page:
    """Title lines, headline cards and sections of one report."""

    study: str
    description: str
    stamp: str
    cards: tuple[Card, ...]
    sections: tuple[Section, ...]


def data_uri(image: bytes, image_format: str) -> str:
    """The picture as an address that needs no file and no network."""
    return f"data:{_MEDIA[image_format]};base64,{base64.b64encode(image).decode('ascii')}"


def _view(block: Block, saved: Mapping[str, SavedFigure]) -> dict[str, object]:
    """What the template needs of one block."""
    if isinstance(block, FigureBlock):
        figure = saved[block.name]
        source = data_uri(figure.image, block.image_format)
        return {"kind": "figure", "name": block.name, "caption": block.caption, "source": source, "files": figure.files}
    if isinstance(block, TableBlock):
        return {
            "kind": "table",
            "caption": block.caption,
            "header": block.header,
            "rows": block.rows,
            "words": block.words,
        }
    if isinstance(block, ListingBlock):
        return {"kind": "listing", "caption": block.caption, "text": block.text, "folded": block.folded}
    return {"kind": "text", "text": block.text}


def _views(sections: Sequence[Section], saved: Mapping[str, SavedFigure]) -> list[dict[str, object]]:
    """What the template needs of all sections."""
    return [
        {"anchor": s.anchor, "title": s.title, "blocks": [_view(block, saved) for block in s.blocks]} for s in sections
    ]


def render(page: Page, saved: Mapping[str, SavedFigure]) -> str:
    """The whole page as HTML text.

    Parameters
    ----------
    page : contents.
    saved : name of every figure in the page -> its image and files.
    """
    environment = Environment(
        loader=PackageLoader("romgen.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    css = files("romgen.report").joinpath("templates", "report.css").read_text(encoding="utf-8")
    return environment.get_template("report.html.j2").render(
        study=page.study,
        description=page.description,
        stamp=page.stamp,
        cards=page.cards,
        sections=_views(page.sections, saved),
        css=Markup(css),
        version=romgen.__version__,
    )
