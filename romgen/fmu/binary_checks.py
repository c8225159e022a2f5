"""L0: the binary of a unit for this machine, as a plain loader sees it."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from pathlib import Path

from romgen.fmu.compilers import host_platform
from romgen.fmu.records import LevelRow
from romgen.fmu.templates import runtime_sources

N_FUNCTION = 44
NEWEST_GLIBC = 2.17


def binary_rows(folder: Path) -> Iterator[LevelRow]:
    """Functions that are exported, and the newest C library that is asked for (linux only).

    Parameters
    ----------
    folder : the unpacked unit, with a binary for this machine.
    """
    library = next((folder / "binaries" / host_platform()).iterdir())
    loaded = ctypes.CDLL(str(library))
    names = re.findall(r"FMI2_Export\s+\w+TYPE\s+(\w+);", runtime_sources()["fmi2Functions.h"].decode())
    found = sum(hasattr(loaded, name) for name in names)
    yield LevelRow("L0", f"functions of FMI 2.0 in {library.name}, loaded without an importer", found, N_FUNCTION, 0.0)
    versions = [int(v) for v in re.findall(rb"GLIBC_2\.(\d+)", library.read_bytes())]
    if versions:
        newest = 2.0 + max(versions) / 100.0
        yield LevelRow(
            "L0", "newest GNU C library asked for, 2.04 for version 2.4", newest, 2.0, NEWEST_GLIBC - 2.0 + 1e-9
        )
