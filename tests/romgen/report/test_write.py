"""The written report: every curve has its CSV, the page stands alone, absent stages are absent."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from romgen.report import ReportFiles, ReportInputs, write_report
from romgen.report.blocks import FigureBlock, Section
from romgen.report.curve_table import read_csv
from romgen.report.sections import BUILDERS, sections, spectrogram_section
from romgen.report.style import house_style

SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<?xml"}


@pytest.fixture(scope="module")
def written(full_inputs: ReportInputs, tmp_path_factory: pytest.TempPathFactory) -> ReportFiles:
    """The report of the full synthetic study."""
    return write_report(full_inputs, tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def built(full_inputs: ReportInputs) -> tuple[Section, ...]:
    """All sections of the full synthetic study, in order."""
    with house_style():
        return sections(full_inputs)


@pytest.fixture(scope="module")
def figures(built: tuple[Section, ...]) -> list[FigureBlock]:
    """All figures of the full synthetic study."""
    return [block for section in built for block in section.blocks if isinstance(block, FigureBlock)]


def test_every_figure_is_an_image_of_its_type(written: ReportFiles) -> None:
    """Files start with the signature of their format and hold more than an empty canvas."""
    assert written.figures
    for path in written.figures:
        content = path.read_bytes()
        assert content.startswith(SIGNATURES[path.suffix]), path.name
        assert len(content) > 5_000, path.name


def test_every_csv_equals_the_data_of_its_figure(figures: list[FigureBlock], written: ReportFiles) -> None:
    """What the figures draw is what the files hold, bit for bit, and no file is left over."""
    tables = {table.name: table for figure in figures for table in figure.tables}
    assert {path.stem for path in written.csv} == set(tables)
    for path in written.csv:
        for read, drawn in zip(read_csv(path).columns, tables[path.stem].columns, strict=True):
            assert (read.name, read.unit) == (drawn.name, drawn.unit)
            np.testing.assert_array_equal(read.values, drawn.values)


def test_figure_names_are_unique(figures: list[FigureBlock]) -> None:
    """Two figures or two tables of one name would overwrite each other."""
    names = [figure.name for figure in figures]
    curves = [table.name for figure in figures for table in figure.tables]
    assert len(set(names)) == len(names)
    assert len(set(curves)) == len(curves)


def test_page_needs_no_network(written: ReportFiles) -> None:
    """Every picture is inside; links lead to files beside the page or to anchors in it."""
    text = written.html.read_text(encoding="utf-8")
    assert not re.search(r"https?://|src=\"(?!data:)|url\(|@import|<script|<link", text)
    anchors = set(re.findall(r'<section id="([^"]+)"', text))
    for target in re.findall(r'href="([^"]+)"', text):
        if target.startswith("#"):
            assert target[1:] in anchors
        else:
            assert (written.html.parent / target).is_file()


def test_every_axis_of_every_curve_has_a_unit(figures: list[FigureBlock]) -> None:
    """All labelled axes end in a unit; panels that share an axis may leave it out."""
    labels = [
        text
        for figure in figures
        for axes in figure.figure.axes
        for text in (axes.get_xlabel(), axes.get_ylabel())
        if text
    ]
    assert labels
    assert [text for text in labels if not re.search(r"\[.+\]$", text)] == []


def test_same_inputs_give_the_same_images(full_inputs: ReportInputs, written: ReportFiles, tmp_path: Path) -> None:
    """No time stamps or random identifiers in the pictures."""
    small = replace(
        full_inputs, structure=None, model=None, ring_downs=(), reconstructions=full_inputs.reconstructions[:1]
    )
    for path in write_report(small, tmp_path).figures:
        twin = written.html.parent / "figures" / path.name
        assert path.read_bytes() == twin.read_bytes(), path.name


ABSENT = {
    "warnings": {"warnings": ()},
    "structure": {"structure": None},
    "preload": {"preload": None},
    "modes": {"modes": None},
    "ringdowns": {"reconstructions": ()},
    "spectrogram": {"model": None},
    "energy": {"ring_downs": ()},
    "model": {"model": None},
    "forcing": {"loads": ()},
    "forced": {"forced": None},
    "histories": {"histories": ()},
    "backbone": {"backbones": ()},
    "fmu": {"fmu_export": None, "fmu_check": None, "fmu_replays": {}},
    "cost": {"stages": ()},
}


@pytest.mark.parametrize("anchor", ABSENT)
def test_an_absent_stage_is_left_out(full_inputs: ReportInputs, built: tuple[Section, ...], anchor: str) -> None:
    """Its section is there with the stage and gone without it."""
    place = [section.anchor for section in built].index(anchor)
    assert BUILDERS[place](replace(full_inputs, **ABSENT[anchor])) is None


def test_a_short_record_says_what_is_missing(full_inputs: ReportInputs) -> None:
    """Ten periods give a spectrogram but no instantaneous frequency; the section says so."""
    pair = full_inputs.reconstructions[2]
    motion = replace(pair.trajectory, t=pair.trajectory.t[:500], displacement=pair.trajectory.displacement[:500])
    short = replace(
        full_inputs, reconstructions=(replace(pair, trajectory=motion, displacement=pair.displacement[:500]),)
    )
    with house_style():
        section = spectrogram_section(short)
    assert section is not None
    assert [type(block).__name__ for block in section.blocks] == ["FigureBlock", "TextBlock"]


def test_a_bare_study_still_has_a_page(tmp_path: Path) -> None:
    """Only the name is required."""
    written = write_report(ReportInputs("bare"), tmp_path)
    text = written.html.read_text(encoding="utf-8")
    assert "<h1>bare</h1>" in text
    assert written.figures == written.csv == written.fields == ()


def test_text_is_escaped(tmp_path: Path) -> None:
    """Names from study files cannot inject markup."""
    inputs = ReportInputs("s", title="<b>x</b>", warnings=("a < b & c",))
    text = write_report(inputs, tmp_path).html.read_text(encoding="utf-8")
    assert "<h1>&lt;b&gt;x&lt;/b&gt;</h1>" in text
    assert "a &lt; b &amp; c" in text


def test_matplotlib_settings_are_left_alone(tmp_path: Path) -> None:
    """The house style ends with the report."""
    before = dict(matplotlib.rcParams)
    write_report(ReportInputs("bare"), tmp_path)
    assert dict(matplotlib.rcParams) == before
