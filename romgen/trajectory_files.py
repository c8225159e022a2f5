"""Trajectories in files: MAT cells {t, x}, HDF5, NPZ and CSV, checked at the door."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.settings.quantities import unit_factor
from romgen.trajectory import Trajectory, check_magnitude
from romgen.trajectory_csv import read_csv
from romgen.trajectory_mat import read_motions

log = logging.getLogger(__name__)
Pair = tuple[str, FloatArray, FloatArray]


def read_trajectories(files: Sequence[Path], sensors: Sequence[str], unit: str) -> tuple[Trajectory, ...]:
    """Read all trajectories of all files, displacement converted to m, names unique.

    Parameters
    ----------
    files : .mat (``romgen.trajectory_mat``), .h5/.hdf5 and
        .npz (as written by ``write_trajectories``, or t and x alone), .csv (``romgen.trajectory_csv``).
    sensors : names of the rows of x; CSV columns are found by these names.
    unit : unit of displacement where the file has none, e.g. "m" or "mm".

    Raises
    ------
    InputError : names file, trajectory, row and value: unknown unit, not readable, wrong number of sensors, NaN,
        time that does not increase, a constant sensor, motions about another position than 0.
    """
    _factor(unit, "[data] unit")
    trajectories: list[Trajectory] = []
    for path in map(Path, files):
        read = _READERS.get(path.suffix.lower())
        if read is None:
            raise InputError(
                "unknown trajectory format", where=str(path), value=path.suffix, advice="use mat, h5, npz, csv"
            )
        if not path.is_file():
            raise InputError("no such file", where=str(path))
        try:
            pairs = read(path, sensors, unit)
        except InputError:
            raise
        except Exception as error:  # h5py, numpy, scipy and zipfile each raise their own for a damaged file
            raise InputError(f"truncated, damaged or of another format ({error})", where=str(path)) from error
        if not pairs:
            raise InputError("holds no trajectory", where=str(path), advice="it needs arrays t and x")
        for name, t, x in pairs:
            where = f"{path.name}, trajectory '{name}'"
            _check(t, x, sensors, where)
            trajectories.append(Trajectory(_unique(name, trajectories), t, tuple(sensors), x))
    return tuple(trajectories)


def write_trajectories(path: Path, trajectories: Iterable[Trajectory]) -> None:
    """Write t (s) and displacement (m) of trajectories to .h5, .hdf5 or .npz, readable by ``read_trajectories``."""
    path = Path(path)
    if path.suffix.lower() == ".npz":
        arrays: dict[str, Any] = {}
        for item in trajectories:
            arrays |= {f"{item.name}/t": item.t, f"{item.name}/x": item.displacement, f"{item.name}/unit": "m"}
        np.savez(path, **arrays)
        return
    if path.suffix.lower() not in (".h5", ".hdf5"):
        raise InputError("unknown trajectory format", where=str(path), value=path.suffix, advice="use h5 or npz")
    with h5py.File(path, "w") as file:
        for item in trajectories:
            group = file.create_group(item.name)
            group.create_dataset("t", data=item.t).attrs["unit"] = "s"
            group.create_dataset("x", data=item.displacement).attrs["unit"] = "m"
            group.attrs["sensors"] = list(item.sensors)


def _factor(unit: str, where: str, si: str = "m") -> float:
    try:
        return unit_factor(unit, si)
    except ValueError as error:
        raise InputError(str(error), where=where) from error


def _time_first(x: Any, n_time: int) -> FloatArray:
    if np.iscomplexobj(x):
        raise ValueError("x is complex, displacements are real")
    x = np.atleast_2d(np.asarray(x, dtype=np.float64))
    return np.ascontiguousarray(x if x.shape[0] == n_time else x.T)


def _read_mat(path: Path, sensors: Sequence[str], unit: str) -> list[Pair]:
    pairs = []
    for number, (label, t, x) in enumerate(read_motions(path)):
        time = np.asarray(t, dtype=np.float64).ravel()
        name = label or f"{path.stem}_{number}"
        pairs.append((name, time, _factor(unit, path.name) * _time_first(x, time.size)))
    return pairs


def _read_hdf5(path: Path, sensors: Sequence[str], unit: str) -> list[Pair]:
    with h5py.File(path) as file:
        if isinstance(file.get("t"), h5py.Dataset) and isinstance(file.get("x"), h5py.Dataset):
            return [_group_pair(path.stem, file, sensors, unit)]
        pairs, others = [], []
        for name, group in file.items():
            held = {"t", "x"} & set(group) if isinstance(group, h5py.Group) else set()
            if len(held) == 2:
                pairs.append(_group_pair(str(name), group, sensors, unit))
            elif held:
                raise InputError("group without t and x", where=f"{path.name}/{name}", value=sorted(group))
            else:
                others.append(str(name))
    if others and pairs:
        log.warning("%s: %s is no group with t and x and was not read", path.name, ", ".join(others))
    elif others:
        raise InputError("no group with t and x", where=path.name, value=others, advice="it needs arrays t and x")
    return pairs


def _group_pair(name: str, group: h5py.Group, sensors: Sequence[str], unit: str) -> Pair:
    """Return t and x of a group; where it names its sensors and the study names one of them, they are found by name."""
    where = f"{Path(group.file.filename).name}, trajectory '{name}'"
    clock = _factor(str(group["t"].attrs.get("unit", "s")), where, "s")
    t = clock * np.asarray(group["t"], dtype=np.float64).ravel()
    x = _factor(str(group["x"].attrs.get("unit", unit)), where) * _time_first(group["x"][()], t.size)
    own = [str(sensor) for sensor in group.attrs.get("sensors", ())]
    if not set(own) & set(sensors):
        return name, t, x
    missing = [sensor for sensor in sensors if sensor not in own]
    if missing:
        raise InputError("no such sensor", where=where, value=missing[0], advice=f"the file has {', '.join(own)}")
    return name, t, x[:, [own.index(sensor) for sensor in sensors]]


def _read_npz(path: Path, sensors: Sequence[str], unit: str) -> list[Pair]:
    with path.open("rb") as file, np.load(file) as arrays:
        names = sorted({key.rpartition("/")[0] for key in arrays.files if key.rpartition("/")[2] == "t"})
        pairs = []
        for name in names:
            prefix = f"{name}/" if name else ""
            if f"{prefix}x" not in arrays:
                raise InputError("array t without array x", where=path.name, value=f"{prefix}t")
            t = np.asarray(arrays[f"{prefix}t"], dtype=np.float64).ravel()
            factor = _factor(str(arrays[f"{prefix}unit"]) if f"{prefix}unit" in arrays else unit, path.name)
            pairs.append((name or path.stem, t, factor * _time_first(arrays[f"{prefix}x"], t.size)))
    return pairs


def _check(t: FloatArray, x: FloatArray, sensors: Sequence[str], where: str) -> None:
    if x.ndim != 2 or x.shape != (t.size, len(sensors)):
        raise InputError(
            "wrong number of sensors or samples",
            where=where,
            value=x.shape,
            advice=f"expected {(t.size, len(sensors))}",
        )
    if t.size < 2:
        raise InputError("too few samples for a motion", where=where, value=t.size)
    bad = ~np.isfinite(np.column_stack([t, x]))
    if bad.any():
        row, column = map(int, np.argwhere(bad)[0])
        name = ("t", *sensors)[column]
        raise InputError("not a finite number", where=f"{where}, row {row}, column '{name}'", value="nan or inf")
    backward = np.flatnonzero(np.diff(t) <= 0)
    if backward.size:
        row = int(backward[0]) + 1
        before, after = t[row - 1 : row + 1].tolist()
        raise InputError("time does not increase", where=f"{where}, row {row}", value=f"{before!r} then {after!r}")
    check_magnitude(x, where)
    constant = np.flatnonzero(np.ptp(x, axis=0) == 0)
    if constant.size:
        raise InputError(
            "the sensor is constant", where=f"{where}, sensor '{sensors[constant[0]]}'", value=float(x[0, constant[0]])
        )
    # One sensor may move to one side only, as the axial one of a beam does; all of them do not.
    if np.all((x.min(axis=0) > 0.0) | (x.max(axis=0) < 0.0)):
        raise InputError(
            "no sensor ever crosses 0, but displacements count from the position of rest",
            where=where,
            value=f"mean {np.mean(x[:, 0]):.4g} m of '{sensors[0]}'",
            advice="subtract what each sensor shows at rest",
        )


def _unique(name: str, known: Sequence[Trajectory]) -> str:
    taken = {item.name for item in known}
    candidate, number = name, 2
    while candidate in taken:
        candidate, number = f"{name}_{number}", number + 1
    return candidate


_READERS: dict[str, Callable[[Path, Sequence[str], str], list[Pair]]] = {
    ".mat": _read_mat,
    ".h5": _read_hdf5,
    ".hdf5": _read_hdf5,
    ".npz": _read_npz,
    ".csv": read_csv,
}
