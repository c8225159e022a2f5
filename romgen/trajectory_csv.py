"""Trajectories in CSV as programs and spreadsheets write them: any separator, decimal comma, byte order mark."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.settings.quantities import unit_factor


def read_csv(path: Path, sensors: Sequence[str], unit: str) -> list[tuple[str, FloatArray, FloatArray]]:
    """Read one trajectory: header "t [s], name [mm], ...", then numbers; columns are found by their names.

    Cells are parted by commas, semicolons or tabs, whichever the header has; where these are not commas, a number may
    have a decimal comma, as spreadsheets write it in many countries.

    Parameters
    ----------
    path : UTF-8 text, with or without a byte order mark.
    sensors : names of the columns, in the order of the result.
    unit : of displacement where the header names none.

    Returns
    -------
    [(name, t (n_time,) in s, x (n_time, n_sensor) in m)]

    Raises
    ------
    InputError : names file, line and column: not UTF-8, no such column, unknown unit, not a number.
    """
    rows, separator = _rows(path)
    if len(rows) < 2:
        raise InputError("no data rows", where=str(path))
    heads = [_head(cell) for cell in rows[0][1]]
    names = [name for name, _ in heads]
    columns = []
    for wanted, kind, default in [("t", "s", "s"), *((sensor, "m", unit) for sensor in sensors)]:
        if wanted not in names:
            raise InputError(
                f"no column '{wanted}'", where=path.name, value=names, advice="header: t [s], name [mm], ..."
            )
        symbol = heads[names.index(wanted)][1] or default
        try:
            columns.append((names.index(wanted), unit_factor(symbol, kind)))
        except ValueError as error:
            raise InputError(str(error), where=f"{path.name}, column '{wanted}'") from error
    comma = separator != ","
    table = np.array([[_number(row, k, line, path, comma) * f for k, f in columns] for line, row in rows[1:]])
    return [(path.stem, table[:, 0].copy(), np.ascontiguousarray(table[:, 1:]))]


def _rows(path: Path) -> tuple[list[tuple[int, list[str]]], str]:
    """Return the rows that are not empty, each with its line in the file, and what parts their cells."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("not UTF-8 text", where=str(path), advice="save it as CSV in UTF-8") from error
    lines = text.splitlines()
    header = next((line for line in lines if line.strip()), "")
    separator = max((",", ";", "\t"), key=header.count)
    reader = csv.reader(lines, delimiter=separator)
    return [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)], separator


def _head(cell: str) -> tuple[str, str]:
    name, _, rest = cell.partition("[")
    return name.strip(), rest.rstrip("] \t").strip()


def _number(row: list[str], column: int, line: int, path: Path, decimal_comma: bool) -> float:
    try:
        return float(row[column].replace(",", ".") if decimal_comma else row[column])
    except (IndexError, ValueError) as error:
        raise InputError("not a number", where=f"{path.name}, line {line}, column {column + 1}", value=row) from error
