"""Segments of a long stage: one file each, and an index that only ever names finished ones."""

from __future__ import annotations

import hashlib
import json
import logging
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from romgen.store import read_file, replace_atomically, write_file

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record")
log = logging.getLogger(__name__)


class SegmentStore:
    """Finished segments of one long stage in a folder.

    A kill at any moment loses at most the segment being written: a file is complete before the index names it, and
    file and index appear by renaming. Segments of another ``key`` (other settings) are discarded; a truncated or
    damaged file ends the usable series, and the stage continues after the last good one. Both are logged.

    Parameters
    ----------
    path : folder of this stage.
    key : hash of everything that the segments depend on.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path, self.key = path, key
        self._entries = self._usable(self._read_index())

    def __len__(self) -> int:
        return len(self._entries)

    def append(self, record: DataclassInstance) -> None:
        """Write one finished segment and then name it in the index."""
        file = self.path / f"segment_{len(self._entries):05d}.h5"
        write_file(file, record)
        self._write_index([*self._entries, {"file": file.name, **_fingerprint(file)}])

    def load_all(self, cls: type[Record]) -> tuple[Record, ...]:
        """Read all finished segments in their order."""
        return tuple(read_file(self.path / entry["file"], cls) for entry in self._entries)

    def last(self, cls: type[Record]) -> Record | None:
        """Read the last finished segment; None before the first."""
        return read_file(self.path / self._entries[-1]["file"], cls) if self._entries else None

    def clear(self) -> None:
        """Remove the folder: the stage is finished and its result is stored elsewhere."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._entries = []

    def _read_index(self) -> list[dict[str, Any]]:
        try:
            index = json.loads((self.path / "index.json").read_text(encoding="utf-8"))
            key, entries = index["key"], list(index["segments"])
        except FileNotFoundError:
            return []
        except (ValueError, KeyError, TypeError):
            log.warning("%s: index is damaged, segments are computed again", self.path)
            return []
        if key != self.key:
            log.warning("%s: %d segments belong to other settings and are discarded", self.path, len(entries))
            return []
        return entries

    def _usable(self, entries: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return the leading entries whose files have the length and hash that the index states."""
        for count, entry in enumerate(entries):
            file = self.path / str(entry["file"])
            if not file.is_file() or _fingerprint(file) != {k: entry[k] for k in ("length", "sha256")}:
                log.warning("%s: truncated or damaged, continuing after the segment before it", file)
                return entries[:count]
        return entries

    def _write_index(self, entries: list[dict[str, Any]]) -> None:
        text = json.dumps({"key": self.key, "segments": entries}, indent=1)
        replace_atomically(self.path / "index.json", lambda temporary: _write_text(temporary, text))
        self._entries = entries


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _fingerprint(path: Path) -> dict[str, Any]:
    with open(path, "rb") as file:
        return {"length": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}
