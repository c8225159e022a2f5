"""L0: the binary of a unit for this machine, as a plain loader sees it."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from pathlib import Path

from romgen.fmu.compilers import host_platform
from romgen.fmu.export3 import FOLDERS
from romgen.fmu.records import LevelRow
from romgen.fmu.templates import runtime_sources, runtime_sources3

NEWEST_GLIBC = 2.17


def host_binaries(folder: Path, version: str) -> Path:
    """Where the binary for this machine lies, if there is one; ``version`` is that of FMI."""
    return folder / "binaries" / (host_platform() if version == "2.0" else FOLDERS[host_platform()])


def binary_rows(folder: Path, version: str) -> Iterator[LevelRow]:
    """Functions that are exported, and the newest C library that is asked for (linux only).

    Parameters
    ----------
    folder : the unpacked unit, with a binary for this machine.
    version : of FMI, which declares 44 functions in 2.0 and 75 in 3.0.
    """
    library = next(host_binaries(folder, version).iterdir())
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
