"""Records in HDF5: any frozen dataclass of arrays is written and read back with units and axes."""

from __future__ import annotations

import os
import types
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import h5py
import numpy as np

from romgen.errors import StoreError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

SCHEMA_VERSION = 1
Record = TypeVar("Record")

# Arrays above this size are chunked and carry a checksum per chunk, so that damaged bytes are found on reading.
CHECKSUM_BYTES = 4096


def write_record(group: h5py.Group, record: DataclassInstance) -> None:
    """Write a frozen dataclass into an empty group.

    Fields may be arrays, scalars, strings, None, records, tuples of these, and mappings with text keys. Units and
    axes of the field metadata become attributes of the dataset.

    Parameters
    ----------
    group : where the fields become datasets and subgroups.
    record : a dataclass instance.

    Raises
    ------
    StoreError : the record holds something that has no place in HDF5.
    """
    group.attrs["record"] = type(record).__name__
    group.attrs["schema_version"] = SCHEMA_VERSION
    for item in fields(record):
        _write(group, item.name, getattr(record, item.name))
        for key in ("unit", "axes"):
            if key in item.metadata:
                group[item.name].attrs[key] = item.metadata[key]


def read_record(group: h5py.Group, cls: type[Record]) -> Record:
    """Read a record of type ``cls`` that ``write_record`` wrote; fields that an older file lacks take their default.

    Raises
    ------
    StoreError : the group holds another record, another schema, or lacks a field without default.
    """
    where = f"{group.file.filename}:{group.name}"
    name = getattr(get_origin(cls) or cls, "__name__", str(cls))
    if group.attrs.get("record") != name:
        raise StoreError(f"holds no {name}", where=where, value=str(group.attrs.get("record")))
    version = int(group.attrs["schema_version"])
    if version != SCHEMA_VERSION:
        raise StoreError(
            f"written with schema {version}, this romgen reads {SCHEMA_VERSION}",
            where=where,
            advice="run the study again with --force",
        )
    origin: Any = get_origin(cls) or cls
    hints = get_type_hints(origin)
    values = {}
    for item in fields(origin):
        if item.name not in group:
            if item.default is not MISSING:
                continue
            raise StoreError(f"field '{item.name}' of {name} is missing", where=where)
        values[item.name] = _read(group[item.name], hints[item.name])
    result: Record = origin(**values)
    return result


def _write(group: h5py.Group, name: str, value: Any) -> None:
    if value is None:
        group[name] = h5py.Empty("f8")
    elif is_dataclass(value) and not isinstance(value, type):
        write_record(group.create_group(name), value)
    elif isinstance(value, Mapping):
        _write(group, name, tuple(value.values()))
        # Keys are free text ("a/b" would be a path), so they are stored as texts in the order of the entries.
        group[name].attrs["keys"] = np.array([str(key) for key in value], dtype=h5py.string_dtype())
    elif isinstance(value, tuple | list):
        child = group.create_group(name)
        for k, entry in enumerate(value):
            _write(child, f"{k:06d}", entry)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        checked = value.nbytes > CHECKSUM_BYTES
        group.create_dataset(name, data=value, chunks=True if checked else None, fletcher32=checked)
    elif isinstance(value, str | Path):
        group[name] = str(value)
    elif isinstance(value, bool | int | float | complex | np.generic):
        group[name] = value
    else:
        raise StoreError("cannot be stored in HDF5", where=f"{group.name}/{name}", value=type(value).__name__)


def _read(item: h5py.Group | h5py.Dataset, hint: Any) -> Any:
    if isinstance(item, h5py.Dataset) and item.shape is None:
        return None
    hint = _member(hint, item)
    origin = get_origin(hint)
    if is_dataclass(origin or hint):
        return read_record(item, hint)
    if origin is tuple:
        return _read_tuple(item, get_args(hint))
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        entries = _read_tuple(item, (get_args(hint)[1], Ellipsis))
        return dict(zip((str(key) for key in item.attrs["keys"]), entries, strict=True))
    if origin is np.ndarray:
        array = item[()]
        array.flags.writeable = False
        return array
    return _read_scalar(item, hint)


def _read_tuple(group: h5py.Group, members: tuple[Any, ...]) -> tuple[Any, ...]:
    entries = [group[key] for key in sorted(group)]
    if len(members) == 2 and members[1] is Ellipsis:
        members = (members[0],) * len(entries)
    return tuple(_read(entry, member) for entry, member in zip(entries, members, strict=True))


def _read_scalar(item: h5py.Dataset, hint: Any) -> Any:
    if hint is Path:
        return Path(item.asstr()[()])
    if h5py.check_string_dtype(item.dtype) is not None:
        return item.asstr()[()]
    return item[()].item()


def _member(hint: Any, item: h5py.Group | h5py.Dataset) -> Any:
    """Choose the member of a union such as ``FloatArray | None`` or ``tuple[int, ...] | str`` that ``item`` holds."""
    if get_origin(hint) not in (Union, types.UnionType):
        return hint
    members = [member for member in get_args(hint) if member is not type(None)]
    if len(members) == 1:
        return members[0]
    if isinstance(item, h5py.Group) and "record" in item.attrs:
        return next(m for m in members if getattr(get_origin(m) or m, "__name__", "") == item.attrs["record"])
    if isinstance(item, h5py.Group):
        return next(m for m in members if get_origin(m) is not None and get_origin(m) is not np.ndarray)
    return next(m for m in members if (get_origin(m) is np.ndarray) == (item.shape != ()))


@contextmanager
def open_for_reading(path: Path) -> Iterator[h5py.File]:
    """Open an HDF5 file; a missing, truncated, damaged or foreign file is a StoreError with one line."""
    if not path.is_file():
        raise StoreError("no such file", where=str(path))
    try:
        with h5py.File(path, "r") as file:
            if "schema_version" not in file.attrs:
                raise StoreError("is not a romgen file", where=str(path))
            yield file
    except (OSError, RuntimeError) as error:
        advice = "a run with --force computes its results anew"
        raise StoreError(f"truncated, damaged or not HDF5 ({error})", where=str(path), advice=advice) from error


def replace_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let ``write`` fill a temporary file, flush it to disk and rename it onto ``path``.

    Whoever reads ``path`` sees the old or the new content, whatever happens in between.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(temporary)
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    _flush_folder(path.parent)


def _flush_folder(folder: Path) -> None:
    """Make the rename itself durable where the system can (a folder cannot be opened on Windows)."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_file(path: Path, record: DataclassInstance) -> None:
    """Write one record as an HDF5 file of its own, atomically."""

    def write(temporary: Path) -> None:
        with h5py.File(temporary, "w") as file:
            file.attrs["schema_version"] = SCHEMA_VERSION
            write_record(file.create_group("record"), record)

    replace_atomically(path, write)


def read_file(path: Path, cls: type[Record]) -> Record:
    """Read one record that ``write_file`` wrote.

    Raises
    ------
    StoreError : the file is missing, truncated, damaged, foreign, or holds another record.
    """
    with open_for_reading(path) as file:
        if "record" not in file:
            raise StoreError("is not a romgen record file", where=str(path))
        return read_record(file["record"], cls)
