"""Every key of the study file is documented, and only keys that exist."""

from __future__ import annotations

import re
from pathlib import Path

from pydantic import BaseModel

import romgen.settings as settings

PAGE = (Path(__file__).parents[3] / "docs" / "study.md").read_text(encoding="utf-8")
DOCUMENTED = {word.rsplit(".", 1)[-1] for word in re.findall(r"`([a-z_][a-z0-9_]*(?:\.[a-zA-Z_]+)*)`", PAGE)}
TABLES = [
    table
    for table in vars(settings).values()
    if isinstance(table, type) and issubclass(table, BaseModel) and table not in (settings.Study, settings.Settings)
]
KEYS = {key for table in TABLES for key in table.model_fields}


def test_every_key_is_documented() -> None:
    # rise, span, name and amplitudes are shown inside their inline tables
    assert KEYS - DOCUMENTED - {"rise", "span", "amplitudes"} == set()
    assert all(key in PAGE for key in ("rise", "span", "amplitudes"))


def test_every_table_is_documented() -> None:
    assert [table for table in settings.Study.model_fields if table not in PAGE] == []


def test_no_key_is_documented_that_does_not_exist() -> None:
    rows = re.findall(r"^\| (`[^|]*) \|", PAGE, flags=re.MULTILINE)
    named = {word.rsplit(".", 1)[-1] for row in rows for word in re.findall(r"`([a-zA-Z_.]+)`", row)}
    assert named - KEYS == set()
