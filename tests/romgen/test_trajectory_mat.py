"""Every way in which MATLAB users keep motions that has one meaning only; the others are refused with what is there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from romgen.errors import InputError, NumericalError
from romgen.trajectory_files import read_trajectories

SENSORS = ("lower", "upper")
T = np.linspace(0.0, 1.0, 11)
X = np.column_stack([np.cos(T), np.sin(3 * T)])


def cells(*rows: tuple[Any, ...]) -> np.ndarray:
    value = np.empty((len(rows), len(rows[0])), dtype=object)
    for i, row in enumerate(rows):
        for j, item in enumerate(row):
            value[i, j] = item
    return value


def struct(**fields: Any) -> np.ndarray:
    value = np.empty((1, 1), dtype=[(name, object) for name in fields])
    for name, item in fields.items():
        value[0, 0][name] = item
    return value


MOTION, TWICE = (T[None], X.T), (2.0 * T[None], X.T)
FORMS = {
    "rows": cells(MOTION, TWICE),
    "columns": cells(MOTION, TWICE).T,
    "three columns": cells(MOTION, TWICE, MOTION).T,
    "time along rows": cells((T[:, None], X), (2.0 * T[:, None], X)),
    "labels first": cells(("push", *MOTION), ("pull", *TWICE)),
    "labels last": cells((*MOTION, "push"), (*TWICE, "pull")),
    "nested cells": cells((cells(MOTION),), (cells(TWICE),)),
    "structs in cells": cells((struct(t=T[None], x=X.T),), (struct(t=2.0 * T[None], x=X.T),)),
    "struct array": np.vstack([struct(t=T[None], x=X.T), struct(t=2.0 * T[None], x=X.T)]),
}


@pytest.mark.parametrize("form", FORMS)
def test_forms_with_one_meaning(tmp_path: Path, form: str) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"comment": "two motions", "data": FORMS[form], "rate": 10.0})
    read = read_trajectories([tmp_path / "a.mat"], SENSORS, "m")
    assert [r.name for r in read[:2]] == (["push", "pull"] if "labels" in form else ["a_0", "a_1"])
    for r, factor in zip(read, (1.0, 2.0, 1.0), strict=False):
        assert np.array_equal(r.t, factor * T)
        assert np.array_equal(r.displacement, X)
    assert len(read) == (3 if form == "three columns" else 2)


def test_structs_of_version_73(tmp_path: Path) -> None:
    """A struct is a group; the fields of an array of structs are references."""
    with h5py.File(tmp_path / "a.mat", "w") as file:
        hidden = file.create_group("#refs#")
        t = [hidden.create_dataset(f"t{k}", data=(1.0 + k) * T[:, None]).ref for k in range(2)]
        x = [hidden.create_dataset(f"x{k}", data=X).ref for k in range(2)]
        group = file.create_group("data")
        for name, references in (("t", t), ("x", x)):
            group.create_dataset(name, data=np.array([references], dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    one, two = read_trajectories([tmp_path / "a.mat"], SENSORS, "m")
    assert np.array_equal(one.displacement, X)
    assert np.array_equal(two.t, 2.0 * T)


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (cells((T[None], X[:-1].T)), r"data: 1 x 2 cells \(1 x 11, 2 x 10, \.\.\)"),
        (cells(("push", "pull")), r"data: 1 x 2 cells \(text, text, \.\.\)"),
        (struct(time=T, x=X), r"data: 1 structs with fields time, x"),
    ],
)
def test_what_does_not_fit_is_shown(tmp_path: Path, data: np.ndarray, shown: str) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"data": data})
    with pytest.raises(InputError, match=rf"{shown}.*give a cell array with t and x of one motion in each row"):
        read_trajectories([tmp_path / "a.mat"], SENSORS, "m")


def test_errors_show_numbers_of_numpy_as_numbers_in_one_line() -> None:
    eigenvalues = np.array([-1.0 + 300.0j, -1.0 - 300.0j, 0.123456789 + 0j, 2.0 + 1.0j])
    error = NumericalError("no", value=eigenvalues)
    assert str(error) == "no; got -1+300j -1-300j 0.12346+0j 2+1j"
    assert str(NumericalError("no", value=np.float64(0.1))) == "no; got 0.1"
    assert str(NumericalError("no", value=(np.float64(0.1), np.int64(3)))) == "no; got (0.1, 3)"
    assert str(NumericalError("no", value=np.arange(20))).endswith("10 11 .. (20 entries)")
