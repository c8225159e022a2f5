"""result.h5: one group per stage with the hash of all that it depends on, never half written."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import h5py

from romgen.errors import StoreError
from romgen.store import SCHEMA_VERSION, open_for_reading, read_record, replace_atomically, write_record

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record")
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StageInfo:
    """How a stored stage came about.

    Attributes
    ----------
    key : hash of its settings and of everything upstream.
    wall_s, peak_memory_bytes : what computing it took.
    messages : warnings and fallbacks that were logged while it ran.
    """

    key: str
    wall_s: float
    peak_memory_bytes: int
    messages: tuple[str, ...] = ()


class ResultStore:
    """Stored stages of one run folder.

    A finished stage first becomes a file of its own (written aside, flushed, renamed); ``consolidate`` merges these
    into result.h5 in the same way and only then removes them. A kill at any moment leaves complete files.

    Parameters
    ----------
    run_dir : folder of the run.
    """

    def __init__(self, run_dir: Path) -> None:
        self.path = run_dir / "result.h5"
        self._pending = run_dir / "stages"
        for leftover in (*run_dir.glob(".*.part"), *self._pending.glob(".*.part")):
            leftover.unlink()
        self._infos = self._scan()

    @property
    def infos(self) -> dict[str, StageInfo]:
        """The stored stages by name."""
        return dict(self._infos)

    def has(self, stage: str, key: str) -> bool:
        """Whether the stage is stored with this key."""
        return stage in self._infos and self._infos[stage].key == key

    def read(self, stage: str, cls: type[Record]) -> Record:
        """Read the record of a stored stage."""
        file = self._file_of(stage)
        with open_for_reading(file) as opened:
            if stage not in opened:
                raise StoreError(f"holds no stage '{stage}'", where=str(file))
            return read_record(opened[stage]["record"], cls)

    def write(self, stage: str, record: DataclassInstance, info: StageInfo) -> None:
        """Store a finished stage, replacing what was stored for it."""

        def fill(temporary: Path) -> None:
            with h5py.File(temporary, "w") as file:
                file.attrs["schema_version"] = SCHEMA_VERSION
                group = file.create_group(stage)
                group.attrs["info"] = json.dumps(asdict(info))
                write_record(group.create_group("record"), record)

        replace_atomically(self._pending / f"{stage}.h5", fill)
        self._infos[stage] = info

    def consolidate(self, keys: Mapping[str, str]) -> None:
        """Merge the stage files into result.h5 in the order of ``keys``; a stage with another key is dropped."""
        pending = sorted(self._pending.glob("*.h5"))
        if not pending:
            return
        self._infos = {stage: self._infos[stage] for stage, key in keys.items() if self.has(stage, key)}
        replace_atomically(self.path, self._merge)
        for file in pending:
            file.unlink()
        self._pending.rmdir()

    def _merge(self, temporary: Path) -> None:
        with h5py.File(temporary, "w", track_order=True) as merged:
            merged.attrs["schema_version"] = SCHEMA_VERSION
            for stage in self._infos:
                with open_for_reading(self._file_of(stage)) as source:
                    source.copy(stage, merged)

    def _file_of(self, stage: str) -> Path:
        pending = self._pending / f"{stage}.h5"
        return pending if pending.is_file() else self.path

    def _scan(self) -> dict[str, StageInfo]:
        """Read the infos of result.h5 and of stage files not yet merged; damaged files are set aside, visibly."""
        infos: dict[str, StageInfo] = {}
        for file in (self.path, *sorted(self._pending.glob("*.h5"))):
            if not file.is_file():
                continue
            try:
                infos |= read_infos(file)
            except StoreError as error:
                aside = self.path.with_name(f"{file.name}.damaged")
                file.replace(aside)
                log.warning("%s; moved to %s, its stages are computed again", error, aside.name)
        return infos


def read_infos(path: Path) -> dict[str, StageInfo]:
    """Return how each stage in a result file came about.

    Raises
    ------
    StoreError : the file is truncated, damaged or foreign.
    """
    with open_for_reading(path) as opened:
        return {stage: _info(opened[stage]) for stage in opened}


def _info(group: h5py.Group) -> StageInfo:
    try:
        values = json.loads(group.attrs["info"])
        return StageInfo(**{**values, "messages": tuple(values["messages"])})
    except (KeyError, TypeError, ValueError) as error:
        raise StoreError("is not a romgen result", where=f"{group.file.filename}:{group.name}") from error
