"""What a run records about itself."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import romgen
from romgen.provenance import Provenance, collect_provenance, git_commit
from romgen.store import read_file, write_file


def test_versions_threads_and_settings_are_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    provenance = collect_provenance("abc", "{}", {"fmu check": 7})
    assert provenance.romgen_version == romgen.__version__
    assert provenance.packages["numpy"] == np.__version__
    assert provenance.environment["OMP_NUM_THREADS"] == "1"
    assert provenance.numba_threads >= 1
    write_file(tmp_path / "p.h5", provenance)
    assert read_file(tmp_path / "p.h5", Provenance) == provenance


def test_commit_of_a_checkout_and_of_an_edited_one(tmp_path: Path) -> None:
    def git(*arguments: str) -> None:
        identity = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", "-C", str(tmp_path), *identity, *arguments], check=True, capture_output=True)

    assert git_commit(tmp_path) == ""
    git("init")
    assert git_commit(tmp_path) == ""
    (tmp_path / "__init__.py").write_text("a = 1\n")
    git("add", "__init__.py")
    git("commit", "-m", "one")
    clean = git_commit(tmp_path)
    assert len(clean) >= 12
    (tmp_path / "__init__.py").write_text("a = 2\n")
    assert git_commit(tmp_path) == clean + "+changes"
