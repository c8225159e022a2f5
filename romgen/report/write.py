"""Write the report of a study: figures, CSV, field files and the HTML page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from romgen.report.blocks import FigureBlock, Section, TableBlock
from romgen.report.cards import cards
from romgen.report.curve_table import write_csv
from romgen.report.field_files import write_mode_fields, write_preload_field, write_snapshot_series
from romgen.report.html import Page, SavedFigure, render
from romgen.report.inputs import ReportInputs
from romgen.report.sections import sections
from romgen.report.style import house_style, image_bytes


@dataclass(frozen=True)
class ReportFiles:
    """Where everything lies: the page, the images, the curves and the fields for ParaView."""

    html: Path
    figures: tuple[Path, ...]
    csv: tuple[Path, ...]
    fields: tuple[Path, ...]


def _figures(built: tuple[Section, ...]) -> Iterator[FigureBlock]:
    """Every figure of the report."""
    for section in built:
        yield from (block for block in section.blocks if isinstance(block, FigureBlock))


def _save_figure(block: FigureBlock, directory: Path) -> SavedFigure:
    """Write the image under figures/ and its tables under csv/."""
    image = image_bytes(block.figure, block.image_format)
    picture = f"figures/{block.name}.{block.image_format}"
    curves = tuple(f"csv/{table.name}.csv" for table in block.tables)
    (directory / picture).write_bytes(image)
    for path, table in zip(curves, block.tables, strict=True):
        write_csv(directory / path, table)
    return SavedFigure(image, (picture, *curves))


def write_fields(inputs: ReportInputs, directory: Path) -> tuple[Path, ...]:
    """Write what there is for ParaView under vtu/; nothing without a mesh or where it is not wanted."""
    structure = inputs.structure
    if structure is None or not inputs.vtu:
        return ()
    directory.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    if inputs.preload is not None:
        written.append(write_preload_field(directory, structure, inputs.preload))
    if inputs.modes is not None:
        written.append(write_mode_fields(directory, structure, inputs.modes))
    for ring_down in inputs.ring_downs:
        written += write_snapshot_series(directory, structure, ring_down.trajectory)
    return tuple(written)


def _files_section(files: tuple[str, ...]) -> Section:
    """Everything that was written beside the page."""
    folders = dict.fromkeys(name.partition("/")[0] for name in files)
    rows = tuple((f"{f}/", ", ".join(n.partition("/")[2] for n in files if n.startswith(f"{f}/"))) for f in folders)
    return Section("files", "Files", (TableBlock("Written beside this page.", ("folder", "files"), rows, True),))


def write_report(inputs: ReportInputs, directory: Path) -> ReportFiles:
    """Write report.html, figures/, csv/ and vtu/ into ``directory``.

    The page holds its pictures and style itself and needs no network; absent stages are left out.

    Parameters
    ----------
    inputs : the records of the study.
    directory : folder of the run; made where missing, files of an earlier report are overwritten.

    Returns
    -------
    ReportFiles with the paths of everything written.
    """
    for folder in ("figures", "csv"):
        (directory / folder).mkdir(parents=True, exist_ok=True)
    with house_style():
        built = sections(inputs)
        saved = {block.name: _save_figure(block, directory) for block in _figures(built)}
    fields = write_fields(inputs, directory / "vtu")
    drawn = tuple(name for figure in saved.values() for name in figure.files)
    names = (*drawn, *(path.relative_to(directory).as_posix() for path in fields))
    stamp = f"Study {inputs.study}, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
    page = Page(inputs.title or inputs.study, "", stamp, cards(inputs), (*built, _files_section(names)))
    target = directory / "report.html"
    partial = target.with_name("report.html.partial")
    partial.write_text(render(page, saved), encoding="utf-8")
    partial.replace(target)
    pictures = tuple(directory / name for name in drawn if name.startswith("figures/"))
    curves = tuple(directory / name for name in drawn if name.startswith("csv/"))
    return ReportFiles(target, pictures, curves, fields)
