"""What a result was computed with: versions, source state, machine, threads."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numba

import romgen

PACKAGES = (
    "numpy",
    "scipy",
    "h5py",
    "numba",
    "pydantic",
    "matplotlib",
    "fmpy",
    "pythonfmu",
    "scikit-fem",
    "meshio",
    "pypardiso",
    "ziglang",
)
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Provenance:
    """Everything needed to repeat a run.

    Attributes
    ----------
    romgen_version : version of this package.
    git_commit : commit of the source checkout, "+changes" when edited, or "" for an installed package.
    created : UTC time in ISO 8601.
    python, system, machine : interpreter, operating system, processor type.
    cpu_count, numba_threads : of the machine, used by compiled kernels.
    packages : versions of the installed libraries.
    environment : thread variables that were set.
    study_sha256 : of the study's settings (and data files).
    study_json : all settings, defaults included.
    seeds : of every random number that was drawn, by purpose.
    """

    romgen_version: str
    git_commit: str
    created: str
    python: str
    system: str
    machine: str
    cpu_count: int
    numba_threads: int
    packages: dict[str, str]
    environment: dict[str, str]
    study_sha256: str
    study_json: str
    seeds: dict[str, int] = field(default_factory=dict)


def collect_provenance(study_sha256: str, study_json: str, seeds: Mapping[str, int]) -> Provenance:
    """Record versions, machine and threads of this process."""
    return Provenance(
        romgen_version=romgen.__version__,
        git_commit=git_commit(Path(romgen.__file__).parent),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        python=platform.python_version(),
        system=platform.platform(),
        machine=platform.machine(),
        cpu_count=os.cpu_count() or 1,
        numba_threads=numba.get_num_threads(),
        packages=installed_versions(),
        environment={name: os.environ[name] for name in THREAD_VARIABLES if name in os.environ},
        study_sha256=study_sha256,
        study_json=study_json,
        seeds=dict(seeds),
    )


def installed_versions() -> dict[str, str]:
    """Versions of those ``PACKAGES`` that are installed."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return versions


def git_commit(folder: Path) -> str:
    """Commit that ``folder`` is checked out at, "+changes" appended when edited; "" outside of a checkout."""
    commit = _git(folder, "rev-parse", "--short=12", "HEAD")
    if not commit or _git(folder, "ls-files", "__init__.py") == "":
        return ""
    changed = _git(folder, "status", "--porcelain", "--untracked-files=no", ".")
    return commit + ("+changes" if changed else "")


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
