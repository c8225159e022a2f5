"""Which sources a stage's results depend on."""

from __future__ import annotations

import subprocess
import sys

import pytest

from romgen import source_digest as module
from romgen.source_digest import source_digest


@pytest.fixture
def edited(monkeypatch: pytest.MonkeyPatch) -> object:
    """Pretend that the text of one module was edited."""
    original = module._source

    def edit(name: str) -> None:
        def source(wanted: str) -> bytes | None:
            text = original(wanted)
            return text + b"\n# edited" if text is not None and wanted == name else text

        monkeypatch.setattr(module, "_source", source)

    return edit


@pytest.mark.parametrize(
    ("stages", "changed", "matters"),
    [
        ("romgen.model_stages", "fem.contact", True),  # through fe_stages, which is imported by its name
        ("romgen.model_stages", "romgen.structure", True),
        ("romgen.model_stages", "romgen.conjugacy", False),
        ("romgen.learning_stages", "romgen.conjugacy", True),
        ("romgen.learning_stages", "romgen.report.html", False),
        ("romgen.fmu_stages", "fmu_templates", True),
        ("romgen.report_stages", "romgen.report.html", True),
    ],
)
def test_a_stage_depends_on_what_it_imports(stages: str, changed: str, matters: bool, edited: object) -> None:
    before = source_digest(stages)
    assert callable(edited)
    edited(changed)
    assert (source_digest(stages) != before) == matters


def test_foreign_code_counts_as_nothing() -> None:
    assert source_digest("json") == source_digest("tests.nowhere")


def test_nothing_is_imported_to_be_read() -> None:
    """A study from data runs where the libraries of the finite-element half are missing."""
    code = (
        "import sys; sys.modules['skfem'] = None; from romgen.source_digest import source_digest; "
        "source_digest('romgen.model_stages'); assert 'fem' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
