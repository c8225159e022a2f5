"""Segments: append, reload, and survive truncation, a killed writer and other settings."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from romgen.arrays import FloatArray
from romgen.segments import SegmentStore
from tests.records import same


@dataclass(frozen=True)
class Piece:
    start: int
    values: FloatArray


def piece(start: int) -> Piece:
    return Piece(start, np.arange(start, start + 10.0))


def filled(path: Path, count: int = 3) -> SegmentStore:
    store = SegmentStore(path, "key")
    for start in range(count):
        store.append(piece(start))
    return store


def test_append_and_reload(tmp_path: Path) -> None:
    assert SegmentStore(tmp_path, "key").last(Piece) is None
    filled(tmp_path)
    again = SegmentStore(tmp_path, "key")
    assert len(again) == 3
    last = again.last(Piece)
    assert last is not None
    assert same(last, piece(2))
    assert all(same(a, piece(k)) for k, a in enumerate(again.load_all(Piece)))


@pytest.mark.parametrize("damage", ["truncate", "flip", "remove"])
def test_damaged_segment_ends_the_series(tmp_path: Path, damage: str, caplog: pytest.LogCaptureFixture) -> None:
    filled(tmp_path)
    file = tmp_path / "segment_00001.h5"
    content = file.read_bytes()
    if damage == "truncate":
        file.write_bytes(content[:-1])
    elif damage == "flip":
        file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    else:
        file.unlink()
    with caplog.at_level(logging.WARNING):
        store = SegmentStore(tmp_path, "key")
    assert len(store) == 1
    assert "segment_00001.h5: truncated or damaged" in caplog.text
    store.append(piece(7))
    assert [p.start for p in SegmentStore(tmp_path, "key").load_all(Piece)] == [0, 7]


def test_damaged_index_and_other_key(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    filled(tmp_path)
    with caplog.at_level(logging.WARNING):
        assert len(SegmentStore(tmp_path, "other")) == 0
        (tmp_path / "index.json").write_text('{"key": "key", "segm')
        assert len(SegmentStore(tmp_path, "key")) == 0
    assert "3 segments belong to other settings" in caplog.text
    assert "index is damaged" in caplog.text


def test_clear(tmp_path: Path) -> None:
    store = filled(tmp_path / "stage")
    store.clear()
    assert not (tmp_path / "stage").exists()
    assert len(store) == 0


WRITER = """
import sys
from pathlib import Path
from tests.romgen.test_segments import SegmentStore, piece
store = SegmentStore(Path(sys.argv[1]), "key")
for start in range(len(store), 100000):
    store.append(piece(start))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is a POSIX signal")
def test_kill_at_any_moment_leaves_a_consistent_series(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    before = 0
    for _ in range(3):
        writer = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path)], cwd=Path(__file__).parents[2])
        deadline = time.monotonic() + 30.0
        while not (tmp_path / f"segment_{before + 3:05d}.h5").exists():
            assert time.monotonic() < deadline
            time.sleep(0.001)
        time.sleep(rng.uniform(0.0, 0.02))
        os.kill(writer.pid, signal.SIGKILL)
        writer.wait()
        found = SegmentStore(tmp_path, "key").load_all(Piece)
        assert [p.start for p in found] == list(range(len(found)))
        assert len(found) >= before + 3
        before = len(found)
