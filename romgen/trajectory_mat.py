"""Trajectories in MAT files of any version: cells, structs, or the arrays t and x alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io

from romgen.errors import InputError

EXPECTED = (
    "give a cell array with t and x of one motion in each row, a struct array with fields t and x, or arrays t and x; "
    "x is (n_sensor, n_time)"
)
# Label ("" without), t and x as they lie in the file, x as MATLAB shows it.
Motion = tuple[str, Any, Any]


def read_motions(path: Path) -> list[Motion]:
    """Return label, t and x of every motion of the first variable that holds motions.

    A row of cells may hold strings beside t and x, of which the first becomes the label. Where rows do not fit, columns
    are tried; a cell may itself be a cell or a struct of one motion.

    Raises
    ------
    InputError : not a MAT file, or no variable fits.
    """
    contents = _version_73(path) if h5py.is_hdf5(path) else _version_5(path)
    for value in contents.values():
        motions = _motions(value)
        if motions:
            return motions
    if "t" in contents and "x" in contents:
        return [("", contents["t"], contents["x"])]
    raise InputError(
        "neither a cell array with columns t and x, nor t and x",
        where=str(path),
        value=[_described(name, value) for name, value in contents.items()],
        advice=EXPECTED,
    )


def _motions(value: Any) -> list[Motion]:
    """Return the motions of a variable, none where one does not fit."""
    if isinstance(value, list):
        found = [_motion([item]) for item in value]
        return [motion for motion in found if motion is not None] if None not in found else []
    if not _is_cell(value):
        return []
    for arrangement in (value, value.T, value.reshape(-1, 1)):
        found = [_motion(row) for row in arrangement]
        motions = [motion for motion in found if motion is not None]
        if motions and len(motions) == len(found):
            return motions
    return []


def _motion(row: Sequence[Any]) -> Motion | None:
    """Return the motion of a row of cells; None where it is none."""
    labels = [cell for cell in row if isinstance(cell, str)]
    others = [cell for cell in row if not isinstance(cell, str)]
    if len(others) == 1 and _is_cell(others[0]):
        return _motion([*labels, *others[0].ravel()])
    if len(others) == 1 and isinstance(others[0], list) and len(others[0]) == 1:
        return _motion([*labels, others[0][0]])
    if len(others) == 1 and isinstance(others[0], Mapping):
        fields = others[0]
        labels += [text for text in fields.values() if isinstance(text, str)]
        others = [fields.get("t"), fields.get("x")]
    if len(others) < 2 or not _fits(others[0], others[1]):
        return None
    return labels[0] if labels else "", others[0], others[1]


def _fits(t: Any, x: Any) -> bool:
    """Whether t is a vector and x a matrix with as many samples."""
    if not all(isinstance(item, np.ndarray) and item.dtype.kind in "iufc" for item in (t, x)):
        return False
    return bool(t.size == max(t.shape, default=0) and x.ndim <= 2 and t.size in x.shape)


def _is_cell(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 2 and value.size > 0


def _described(name: str, value: Any) -> str:
    """Return the name of a variable with what MATLAB would say of it."""
    if isinstance(value, list):
        return f"{name}: {len(value)} structs with fields {', '.join(value[0]) if value else 'none'}"
    if isinstance(value, np.ndarray) and value.ndim == 2:
        size = " x ".join(map(str, value.shape))
        inside = ", ".join(
            "text" if isinstance(cell, str) else " x ".join(map(str, np.shape(cell))) for cell in value.ravel()[:4]
        )
        return f"{name}: {size} cells ({inside}, ..)" if value.dtype == object else f"{name}: {size}"
    return name


def _version_5(path: Path) -> dict[str, Any]:
    try:
        contents = scipy.io.loadmat(path, chars_as_strings=True)
    except (ValueError, NotImplementedError, OSError) as error:
        raise InputError(f"not a MAT file: {error}", where=str(path)) from error
    return {name: _plain(value) for name, value in contents.items() if not name.startswith("__")}


def _plain(value: Any) -> Any:
    """Return text as str, structs as a list of mappings, cells with their contents so converted."""
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names is not None:
        return [{name: _plain(item[name]) for name in value.dtype.names} for item in value.ravel()]
    if value.dtype.kind == "U":
        return " ".join(value.ravel().tolist())
    if value.dtype != object:
        return value
    cells = np.empty(value.shape, dtype=object)
    for index, item in np.ndenumerate(value):
        cells[index] = _plain(item)
    return cells


def _version_73(path: Path) -> dict[str, Any]:
    with h5py.File(path) as file:
        return {name: _stored(item, file) for name, item in file.items() if name[0] != "#"}


def _stored(item: Any, file: h5py.File) -> Any:
    """Return an item as ``_plain`` does: MATLAB stores arrays transposed, cells and fields of structs as references."""
    if isinstance(item, h5py.Group):
        return list(_structs({name: _stored(member, file) for name, member in item.items()}))
    if item.dtype == h5py.ref_dtype:
        cells = np.empty(item.shape, dtype=object)
        for index, reference in np.ndenumerate(item[()]):
            cells[index] = _stored(file[reference], file)
        return cells.T
    if item.attrs.get("MATLAB_class", b"") == b"char":
        return "".join(map(chr, item[()].T.ravel()))
    return item[()].T


def _structs(fields: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield one mapping for a struct, one for each of an array of structs, whose fields are cells."""
    count = {value.size for value in fields.values() if _is_cell(value)}
    if len(count) != 1 or not all(_is_cell(value) for value in fields.values()):
        yield fields
        return
    for k in range(count.pop()):
        yield {name: value.ravel()[k] for name, value in fields.items()}
