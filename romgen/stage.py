"""A stage of the pipeline: what it stores, what it depends on, how it is computed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import romgen
from romgen.errors import InputError
from romgen.progress import Report
from romgen.result_store import ResultStore, StageInfo
from romgen.segments import SegmentStore
from romgen.settings import DataSettings, FmuSettings, LoadHistorySettings, MeshSettings, Settings, Study
from romgen.source_digest import source_digest
from romgen.store import SCHEMA_VERSION

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record")


class Context:
    """What a stage may use: the study, the records of earlier stages, its run folder, its progress report."""

    def __init__(self, study: Study, run_dir: Path, store: ResultStore, keys: Mapping[str, str]) -> None:
        self.study, self.run_dir, self._store, self._keys = study, run_dir, store, keys
        self._records: dict[str, Any] = {}
        self.stage, self.key = "", ""
        self.report: Report = _ignore

    def record(self, stage: str, cls: type[Record]) -> Record:
        """Return the record of an earlier stage, reading it from result.h5 only when it is asked for."""
        if stage not in self._records:
            self._records[stage] = self._store.read(stage, cls)
        found: Record = self._records[stage]
        return found

    def remember(self, stage: str, record: object) -> None:
        """Keep the record of the stage that was just computed."""
        self._records[stage] = record

    def segments(self) -> SegmentStore:
        """Return the finished segments of the running stage."""
        return SegmentStore(self.run_dir / "segments" / self.stage, self.key)

    def infos(self) -> dict[str, StageInfo]:
        """Return time, memory and messages of the stages that are stored and up to date, in their order."""
        stored = self._store.infos
        return {stage: stored[stage] for stage, key in self._keys.items() if self._store.has(stage, key)}


def _ignore(fraction: float, text: str) -> None:
    """Report to nobody."""


def _no_files(study: Study) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class Stage:
    """One step of the pipeline.

    Attributes
    ----------
    name : group in result.h5 and key in summary.json.
    record : class of the stored record.
    upstream : stages whose records it uses.
    tables : tables of study.toml it depends on, dotted for a single key.
    compute : the work.
    files : names in the run folder that it writes beside its record.
    """

    name: str
    record: type[DataclassInstance]
    upstream: tuple[str, ...]
    tables: tuple[str, ...]
    compute: Callable[[Context], DataclassInstance]
    files: Callable[[Study], tuple[str, ...]] = _no_files


def stage_keys(stages: Sequence[Stage], study: Study) -> dict[str, str]:
    """Hash of every stage over its own tables, its source text, the keys upstream, the version and the file schema.

    Equal keys mean equal results; a changed table or module changes the keys of exactly the stages that depend on it.
    """
    keys: dict[str, str] = {}
    for stage in stages:
        content = {
            "stage": stage.name,
            "version": romgen.__version__,
            "schema": SCHEMA_VERSION,
            "source": source_digest(stage.compute.__module__),
            "tables": {table: table_content(study, table) for table in stage.tables},
            "upstream": [keys[name] for name in stage.upstream],
        }
        keys[stage.name] = _sha256(content)
    return keys


def study_key(study: Study) -> str:
    """Hash of all tables and of the data files."""
    return _sha256({table: table_content(study, table) for table in type(study).model_fields})


def table_content(study: Study, table: str) -> Any:
    """Return one table (or one key of it) as plain values; data files are represented by their content."""
    value: Any = reduce(getattr, table.split("."), study)
    if isinstance(value, DataSettings):
        return {**value.model_dump(mode="json"), "files": [_file_sha256(path) for path in value.files]}
    if isinstance(value, FmuSettings) and value.icon is not None:
        return {**value.model_dump(mode="json"), "icon": _file_sha256(value.icon)}
    return _plain(value)


def _plain(value: Any) -> Any:
    if isinstance(value, LoadHistorySettings) and value.file is not None:
        return {**value.model_dump(mode="json"), "file": _file_sha256(value.file)}
    if isinstance(value, MeshSettings):
        return {**value.model_dump(mode="json"), "file": _file_sha256(value.file)}
    if isinstance(value, Settings):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return value


def _sha256(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _file_sha256(path: Path) -> str:
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError("cannot be read", where="input file", value=str(path)) from error
