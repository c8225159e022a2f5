"""Trajectory files: round trips, units, and errors that name file, row and value."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from romgen.errors import InputError
from romgen.trajectory import Trajectory
from romgen.trajectory_files import read_trajectories, write_trajectories

SENSORS = ("lower", "upper")
T = np.linspace(0.0, 1.0, 11)
X = np.column_stack([np.cos(T), np.sin(3 * T)])


def cells(x: np.ndarray) -> np.ndarray:
    value = np.empty((1, 2), dtype=object)
    value[0, 0], value[0, 1] = T[None], x.T
    return value


@pytest.mark.parametrize("suffix", ["h5", "npz"])
def test_round_trip_keeps_every_bit(tmp_path: Path, suffix: str) -> None:
    written = [Trajectory("one", T, SENSORS, X), Trajectory("two", 2 * T, SENSORS, -X)]
    write_trajectories(tmp_path / f"a.{suffix}", written)
    read = read_trajectories([tmp_path / f"a.{suffix}"], SENSORS, "m")
    assert [r.name for r in read] == ["one", "two"]
    for r, w in zip(read, written, strict=True):
        assert np.array_equal(r.t, w.t)
        assert np.array_equal(r.displacement, w.displacement)


def test_sensors_that_a_file_names_are_found_by_name(tmp_path: Path) -> None:
    """The order of a study is not that of the file."""
    write_trajectories(tmp_path / "a.h5", [Trajectory("one", T, SENSORS, X)])
    (read,) = read_trajectories([tmp_path / "a.h5"], ("upper", "lower"), "m")
    assert np.array_equal(read.displacement, X[:, ::-1])
    (read,) = read_trajectories([tmp_path / "a.h5"], ("upper",), "m")
    assert np.array_equal(read.displacement, X[:, 1:])
    (read,) = read_trajectories([tmp_path / "a.h5"], ("left", "right"), "m")  # new names for all of them
    assert np.array_equal(read.displacement, X)
    with pytest.raises(InputError, match="no such sensor; got middle; the file has lower, upper"):
        read_trajectories([tmp_path / "a.h5"], ("upper", "middle"), "m")


@pytest.mark.parametrize("flat", [True, False])
def test_hdf5_of_others(tmp_path: Path, flat: bool) -> None:
    """Sensors first, time as a column, in mm; with or without a group."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file if flat else file.create_group("run")
        group["t"], group["x"] = T[:, None], 1e3 * X.T
        group["x"].attrs["unit"] = "mm"
    (read,) = read_trajectories([tmp_path / "a.h5"], SENSORS, "m")
    assert read.name == ("a" if flat else "run")
    assert read.displacement == pytest.approx(X, rel=1e-15)


def test_hdf5_with_other_contents(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """What is no motion is named; half a motion is refused."""
    write_trajectories(tmp_path / "a.h5", [Trajectory("one", T, SENSORS, X)])
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["temperature"] = 20.0
    assert [r.name for r in read_trajectories([tmp_path / "a.h5"], SENSORS, "m")] == ["one"]
    assert "a.h5: temperature is no group with t and x and was not read" in caplog.text
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["half/t"] = T
    with pytest.raises(InputError, match=r"a.h5/half: group without t and x; got \['t'\]"):
        read_trajectories([tmp_path / "a.h5"], SENSORS, "m")


@pytest.mark.parametrize("factor", [1e200, 1e-200])
def test_displacements_that_cannot_be_squared_are_refused(tmp_path: Path, factor: float) -> None:
    np.savez(tmp_path / "a.npz", t=T, x=factor * X)
    with pytest.raises(InputError, match=r"too large or too small to compute with; got at most 1e.200 m"):
        read_trajectories([tmp_path / "a.npz"], SENSORS, "m")


def test_npz_without_t(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", offset=1.0, displacement=X)
    with pytest.raises(InputError, match="holds no trajectory; it needs arrays t and x"):
        read_trajectories([tmp_path / "a.npz"], SENSORS, "m")


def test_complex_displacement_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=T, x=X + 1j)
    with pytest.raises(InputError, match="x is complex"):
        read_trajectories([tmp_path / "a.npz"], SENSORS, "m")


def test_mat_cells_are_sensor_by_time_in_the_given_unit(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"xData": cells(X)})
    (read,) = read_trajectories([tmp_path / "a.mat"], SENSORS, "mm")
    assert read.displacement == pytest.approx(1e-3 * X, rel=1e-15)


def test_mat_v73_cells(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.mat", "w") as file:
        group = file.create_group("#refs#")
        t, x = group.create_dataset("a", data=T[:, None]), group.create_dataset("b", data=X)
        file.create_dataset("xData", data=np.array([[t.ref], [x.ref]], dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    (read,) = read_trajectories([tmp_path / "a.mat"], SENSORS, "m")
    assert np.array_equal(read.displacement, X)


@pytest.mark.parametrize("hdf5", [False, True])
def test_mat_with_one_motion(tmp_path: Path, hdf5: bool) -> None:
    if hdf5:
        with h5py.File(tmp_path / "a.mat", "w") as file:
            file["t"], file["x"] = T[:, None], X  # as MATLAB stores (n_sensor, n_time)
    else:
        scipy.io.savemat(tmp_path / "a.mat", {"t": T, "x": X.T})
    (read,) = read_trajectories([tmp_path / "a.mat"], SENSORS, "m")
    assert np.array_equal(read.displacement, X)


def test_mat_without_t_and_x(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"time": T, "y": X})
    with pytest.raises(InputError, match=r"nor t and x; got \['time: 1 x 11', 'y: 11 x 2'\]; give a cell array"):
        read_trajectories([tmp_path / "a.mat"], SENSORS, "m")


def test_csv_units_of_the_header(tmp_path: Path) -> None:
    rows = ["t [ms], upper [mm], other, lower [m]"]
    rows += [f"{1e3 * t!r},{1e3 * x[1]!r},7,{x[0]!r}" for t, x in zip(T.tolist(), X.tolist(), strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(rows), encoding="utf-8")
    (read,) = read_trajectories([tmp_path / "a.csv"], SENSORS, "m")
    assert read.t == pytest.approx(T, rel=1e-15)
    assert read.displacement == pytest.approx(X, rel=1e-15)


def test_names_of_several_files_are_unique(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        np.savez(tmp_path / folder / "run.npz", t=T, x=X)
    read = read_trajectories([tmp_path / "a" / "run.npz", tmp_path / "b" / "run.npz"], SENSORS, "m")
    assert [r.name for r in read] == ["run", "run_2"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("nan", r"row 3, column 'upper': not a finite number"),
        ("time", r"row 5: time does not increase"),
        ("constant", r"sensor 'lower': the sensor is constant"),
        ("sensors", r"wrong number of sensors or samples; got \(11, 3\)"),
    ],
)
def test_bad_data_are_named(tmp_path: Path, change: str, message: str) -> None:
    t, x = T.copy(), X.copy()
    if change == "nan":
        x[3, 1] = np.nan
    elif change == "time":
        t[5] = t[4]
    elif change == "constant":
        x[:, 0] = 1.0
    else:
        x = np.column_stack([x, x[:, 0]])
    np.savez(tmp_path / "run.npz", t=t, x=x)
    with pytest.raises(InputError, match=message):
        read_trajectories([tmp_path / "run.npz"], SENSORS, "m")


def test_one_sample_is_no_motion(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", t=T[:1], x=X[:1])
    with pytest.raises(InputError, match="too few samples for a motion; got 1"):
        read_trajectories([tmp_path / "run.npz"], SENSORS, "m")


def test_sensors_with_an_offset_are_named(tmp_path: Path) -> None:
    """All sensors on one side of 0 show no motion about rest; one of them may."""
    np.savez(tmp_path / "run.npz", t=T, x=X + np.array([2.0, -3.0]))
    with pytest.raises(InputError, match=r"no sensor ever crosses 0.*of 'lower'; subtract what each sensor shows"):
        read_trajectories([tmp_path / "run.npz"], SENSORS, "m")
    np.savez(tmp_path / "run.npz", t=T, x=X + np.array([2.0, -0.5]))
    assert len(read_trajectories([tmp_path / "run.npz"], SENSORS, "m")) == 1


def test_csv_cell_that_is_no_number(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [s],lower [m],upper [m]\n0,1,2\n1,x,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.csv, line 3, column 2: not a number"):
        read_trajectories([tmp_path / "a.csv"], SENSORS, "m")


@pytest.mark.parametrize(
    ("separator", "decimal", "encoding", "micro"),
    [
        (";", ",", "utf-8-sig", "\N{MICRO SIGN}m"),
        ("\t", ".", "utf-8", "\N{GREEK SMALL LETTER MU}m"),
        (",", ".", "utf-8-sig", "um"),
    ],
)
def test_csv_of_spreadsheets(tmp_path: Path, separator: str, decimal: str, encoding: str, micro: str) -> None:
    """Byte order mark, semicolons with decimal commas, tabs, both characters for micro, rows without any number."""
    rows = [["t [s]", "Tr\u00e4ger links", f"upper [{micro}]"]]
    rows += [[repr(t), repr(x[0]), repr(1e6 * x[1])] for t, x in zip(T.tolist(), X.tolist(), strict=True)]
    lines = [
        separator.join(cell if k == 0 else cell.replace(".", decimal) for cell in row) for k, row in enumerate(rows)
    ]
    (tmp_path / "a.csv").write_text("\n".join([*lines, 2 * separator, ""]), encoding=encoding)
    (read,) = read_trajectories([tmp_path / "a.csv"], ("Tr\u00e4ger links", "upper"), "m")
    assert np.array_equal(read.t, T)
    assert read.displacement == pytest.approx(X, rel=1e-15)


def test_csv_that_is_not_utf8(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,Tr\u00e4ger\n0,1\n", encoding="latin-1")
    with pytest.raises(InputError, match="not UTF-8 text; save it as CSV in UTF-8"):
        read_trajectories([tmp_path / "a.csv"], ("Tr\u00e4ger",), "m")


def test_csv_line_numbers_count_empty_lines(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [s],lower [m],upper [m]\n\n0,1,2\n1,x,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"line 4, column 2"):
        read_trajectories([tmp_path / "a.csv"], SENSORS, "m")


def test_unknown_format(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown trajectory format"):
        read_trajectories([tmp_path / "a.xls"], SENSORS, "m")


def test_named_pairs_without_a_unit_have_that_of_the_study(tmp_path: Path) -> None:
    t = np.linspace(0.0, 1.0, 11)
    x = t[:, None]
    np.savez(tmp_path / "pairs.npz", **{"a/t": t, "a/x": x, "b/t": t, "b/x": x, "b/unit": "um"})
    a, b = read_trajectories([tmp_path / "pairs.npz"], ("tip",), "mm")
    assert a.displacement[-1] == pytest.approx(1e-3)
    assert b.displacement[-1] == pytest.approx(1e-6)


def test_hdf5_time_has_the_unit_that_it_names(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "slow.h5", "w") as file:
        group = file.create_group("a")
        group.create_dataset("t", data=np.linspace(0.0, 1000.0, 11)).attrs["unit"] = "ms"
        group.create_dataset("x", data=np.linspace(0.0, 1.0, 11)[:, None])
    assert read_trajectories([tmp_path / "slow.h5"], ("tip",), "m")[0].t[-1] == pytest.approx(1.0)
