"""result.h5 is complete or absent, says what is stored with which key, and survives damage visibly."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest

from romgen.arrays import FloatArray
from romgen.errors import StoreError
from romgen.result_store import ResultStore, StageInfo
from tests.records import same


@dataclass(frozen=True)
class Numbers:
    values: FloatArray


KEYS = {"first": "k1", "second": "k2"}


def filled(run_dir: Path) -> ResultStore:
    store = ResultStore(run_dir)
    for stage, key in KEYS.items():
        store.write(stage, Numbers(np.arange(1000.0)), StageInfo(key, 1.5, 10**8, ("a fallback",)))
    return store


def test_stages_are_found_before_and_after_merging(tmp_path: Path) -> None:
    filled(tmp_path)
    for merged in (False, True):
        store = ResultStore(tmp_path)
        assert store.has("first", "k1")
        assert not store.has("first", "k2")
        assert same(store.read("second", Numbers), Numbers(np.arange(1000.0)))
        assert store.infos["second"] == StageInfo("k2", 1.5, 10**8, ("a fallback",))
        assert store.path.exists() == merged
        store.consolidate(KEYS)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.h5"]


def test_newer_stage_replaces_the_merged_one(tmp_path: Path) -> None:
    filled(tmp_path).consolidate(KEYS)
    store = ResultStore(tmp_path)
    store.write("first", Numbers(np.zeros(2)), StageInfo("new", 0.1, 1))
    assert same(ResultStore(tmp_path).read("first", Numbers), Numbers(np.zeros(2)))
    store.consolidate({"first": "new", "second": "k2"})
    assert same(ResultStore(tmp_path).read("first", Numbers), Numbers(np.zeros(2)))
    assert ResultStore(tmp_path).has("second", "k2")


def test_stale_stage_is_dropped_when_merging(tmp_path: Path) -> None:
    filled(tmp_path).consolidate({"first": "k1", "second": "changed"})
    assert list(ResultStore(tmp_path).infos) == ["first"]
    with pytest.raises(StoreError, match="holds no stage 'second'"):
        ResultStore(tmp_path).read("second", Numbers)


def test_failed_merge_keeps_everything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filled(tmp_path).consolidate(KEYS)
    before = (tmp_path / "result.h5").read_bytes()
    store = ResultStore(tmp_path)
    store.write("first", Numbers(np.zeros(2)), StageInfo("new", 0.1, 1))

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(h5py.Group, "copy", killed)
    with pytest.raises(KeyboardInterrupt):
        store.consolidate({"first": "new", "second": "k2"})
    monkeypatch.undo()
    assert (tmp_path / "result.h5").read_bytes() == before
    assert ResultStore(tmp_path).has("first", "new")


def test_leftovers_of_a_killed_write_are_removed(tmp_path: Path) -> None:
    (tmp_path / ".result.h5.123.part").write_bytes(b"half")
    ResultStore(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["result.h5", "stages/first.h5"])
def test_damaged_file_is_set_aside(tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture) -> None:
    store = filled(tmp_path)
    if name == "result.h5":
        store.consolidate(KEYS)
    file = tmp_path / name
    file.write_bytes(file.read_bytes()[:100])
    with caplog.at_level(logging.WARNING):
        store = ResultStore(tmp_path)
    assert not store.has("first", "k1")
    assert "truncated, damaged or not HDF5" in caplog.text
    assert (tmp_path / f"{file.name}.damaged").is_file()
    store.write("first", Numbers(np.zeros(2)), StageInfo("k1", 0.1, 1))
    store.consolidate(KEYS)
    assert ResultStore(tmp_path).has("first", "k1")


def test_foreign_groups_are_set_aside(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "result.h5", "w") as file:
        file.attrs["schema_version"] = 1
        file.create_group("first")
    assert ResultStore(tmp_path).infos == {}
    assert (tmp_path / "result.h5.damaged").is_file()
