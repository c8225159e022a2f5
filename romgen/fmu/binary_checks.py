"""L0: the binary of a unit for this machine, as a plain loader sees it."""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from romgen.fmu.compilers import host_platform
from romgen.fmu.export3 import FOLDERS
from romgen.fmu.records import LevelRow
from romgen.fmu.templates import runtime_sources, runtime_sources3

NEWEST_GLIBC = 2.17
LOAD = "import ctypes, sys; ctypes.CDLL(sys.argv[1])"


def host_binaries(folder: Path, version: str) -> Path:
    """Where the binaries for this machine lie, if there are any; ``version`` is that of FMI."""
    return folder / "binaries" / (host_platform() if version == "2.0" else FOLDERS[host_platform()])


def host_library(folder: Path, version: str) -> Path | None:
    """The library for this machine in an unpacked unit, None where there is none."""
    binaries = host_binaries(folder, version)
    return next(iter(sorted(binaries.iterdir())), None) if binaries.is_dir() else None


def load_problem(library: Path) -> str | None:
    """Why a library cannot be loaded, None where it can; tried in a process of its own, which a damaged one may end."""
    command = [sys.executable, "-c", LOAD, str(library)]
    result = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if result.returncode == 0:
        return None
    last = (result.stderr.strip().splitlines() or [""])[-1]
    reason = last.replace(str(library), library.name) or f"its process ended with code {result.returncode}"
    return f"the library {library.name} for this machine cannot be loaded: {reason}"


def binary_rows(library: Path, version: str) -> Iterator[LevelRow]:
    """Functions that are exported, and the newest C library that is asked for (linux only).

    Parameters
    ----------
    library : for this machine; it can be loaded.
    version : of FMI, which declares 44 functions in 2.0 and 75 in 3.0.
    """
    loaded = ctypes.CDLL(str(library))
    header = runtime_sources()["fmi2Functions.h"] if version == "2.0" else runtime_sources3()["fmi3Functions.h"]
    names = re.findall(r"FMI[23]_Export\s+\w+TYPE\s+(\w+);", header.decode())
    found = sum(hasattr(loaded, name) for name in names)
    check = f"functions of FMI {version} in {library.name}, loaded without an importer"
    yield LevelRow("L0", check, found, len(names), 0.0)
    versions = [int(v) for v in re.findall(rb"GLIBC_2\.(\d+)", library.read_bytes())]
    if versions:
        newest = 2.0 + max(versions) / 100.0
        yield LevelRow(
            "L0", "newest GNU C library asked for, 2.04 for version 2.4", newest, 2.0, NEWEST_GLIBC - 2.0 + 1e-9
        )
