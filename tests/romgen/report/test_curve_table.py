"""CSV of the curves: header with units, exact round trip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError, StoreError
from romgen.report.curve_table import curve_table, read_csv, write_csv


def test_round_trip_is_exact(tmp_path: Path) -> None:
    """Awkward doubles, infinities and nan come back bit for bit, with names and units."""
    awkward = np.array([0.1, 1 / 3, -1e-308, 1.7976931348623157e308, np.inf, np.nan])
    table = curve_table("odd", ("frequency", "Hz", awkward), ("amplitude, peak", "m s^-2", -awkward))
    write_csv(tmp_path / "odd.csv", table)
    again = read_csv(tmp_path / "odd.csv")
    assert again.name == "odd"
    assert [(c.name, c.unit) for c in again.columns] == [("frequency", "Hz"), ("amplitude, peak", "m s^-2")]
    np.testing.assert_array_equal(again["frequency"], awkward)
    np.testing.assert_array_equal(again["amplitude, peak"], -awkward)


def test_header_carries_units(tmp_path: Path) -> None:
    """The first line reads ``frequency [Hz],amplitude [m]``."""
    write_csv(tmp_path / "a.csv", curve_table("a", ("frequency", "Hz", [1.0]), ("amplitude", "m", [2.0])))
    assert (tmp_path / "a.csv").read_text() == "frequency [Hz],amplitude [m]\n1.0,2.0\n"


def test_empty_table_keeps_its_columns(tmp_path: Path) -> None:
    """A curve without points is a header alone."""
    write_csv(tmp_path / "e.csv", curve_table("e", ("time", "s", []), ("x", "m", [])))
    assert read_csv(tmp_path / "e.csv")["x"].shape == (0,)


def test_unequal_columns_are_refused() -> None:
    """Columns of two lengths make no table."""
    with pytest.raises(InputError, match="differ in length"):
        curve_table("bad", ("a", "1", [1.0]), ("b", "1", [1.0, 2.0]))


@pytest.mark.parametrize("text", ["", "time,x\n1,2\n", "time [s],x [m]\n1.0\n"])
def test_foreign_files_are_refused(tmp_path: Path, text: str) -> None:
    """No header, no units, or a short row."""
    (tmp_path / "f.csv").write_text(text)
    with pytest.raises(StoreError):
        read_csv(tmp_path / "f.csv")
