"""Columns of numbers with units and their CSV form, ``frequency [Hz],amplitude [m]``."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError, StoreError

_HEADER = re.compile(r"^(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]*)\]$")


@dataclass(frozen=True)
class Column:
    """One named quantity: ``values`` (n_row,) in ``unit`` ("1" where it has none)."""

    name: str
    unit: str
    values: FloatArray


@dataclass(frozen=True)
class CurveTable:
    """Columns of equal length; ``name`` is the stem of its file.

    Raises
    ------
    InputError : columns of unequal length, or not one-dimensional.
    """

    name: str
    columns: tuple[Column, ...]

    def __post_init__(self) -> None:
        shapes = {np.shape(column.values) for column in self.columns}
        if len(shapes) != 1 or len(next(iter(shapes))) != 1:
            raise InputError("the columns differ in length", where=f"curve table {self.name}", value=sorted(shapes))

    def __getitem__(self, name: str) -> FloatArray:
        """Values of the column called ``name``."""
        return next(column.values for column in self.columns if column.name == name)


def curve_table(name: str, *columns: tuple[str, str, object]) -> CurveTable:
    """A table from (name, unit, values) triples."""
    return CurveTable(name, tuple(Column(n, unit, np.asarray(values, dtype=float)) for n, unit, values in columns))


def write_csv(path: Path, table: CurveTable) -> None:
    """Write one header line with units and one line per row; every float64 survives a round trip exactly."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(f"{column.name} [{column.unit}]" for column in table.columns)
        rows = np.column_stack([column.values for column in table.columns]).tolist()
        writer.writerows([repr(value) for value in row] for row in rows)


def read_csv(path: Path) -> CurveTable:
    """Read what :func:`write_csv` wrote.

    Raises
    ------
    StoreError : no header, a header without unit, or a row of another length.
    """
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    heads = [_HEADER.match(text) for text in lines[0]] if lines else []
    if not heads or None in heads:
        raise StoreError("the header lacks a unit", where=str(path), value=lines[:1], advice="write 'name [unit]'")
    if any(len(row) != len(heads) for row in lines[1:]):
        raise StoreError("a row has another number of fields than the header", where=str(path))
    values = np.array(lines[1:], dtype=float).reshape(-1, len(heads))
    named = [(head["name"], head["unit"]) for head in heads if head is not None]
    return CurveTable(path.stem, tuple(Column(n, unit, values[:, k]) for k, (n, unit) in enumerate(named)))
