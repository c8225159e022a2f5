"""Archives whose bytes depend on their content only."""

from __future__ import annotations

import hashlib
import os
import struct
import zlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import zopfli.zlib

from romgen.store import replace_atomically

VERSION, UNIX, UTF8, DEFLATED = 20, 3, 0x800, 8
TIME, DATE = 0, 0x21
"""1980-01-01, 00:00."""

ITERATIONS, BLOCKS = 3, 3
"""Searches for shorter compressed data, and most blocks it is split into: more searches bring some ten bytes, more
blocks 0.8 % of the archive for four times the time."""


def archive_bytes(files: Mapping[str, bytes]) -> bytes:
    """A ZIP archive with sorted names, fixed dates and modes, deflated.

    Written here (APPNOTE.TXT 6.3.10, sections 4.3.7, 4.3.12, 4.3.16), as ``zipfile`` takes no data deflated already.
    """
    names = sorted(files)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        deflated = list(pool.map(lambda name: _deflated(name, files[name]), names))
    body, directory = bytearray(), bytearray()
    for name, data in zip(names, deflated, strict=True):
        encoded, mode = name.encode(), 0o100755 if name.startswith("binaries/") else 0o100644
        flags = 0 if name.isascii() else UTF8
        sizes = (zlib.crc32(files[name]), len(data), len(files[name]), len(encoded), 0)
        fields = struct.pack("<HHHHHIIIHH", VERSION, flags, DEFLATED, TIME, DATE, *sizes)
        directory += b"PK\1\2" + struct.pack("<BB", VERSION, UNIX) + fields
        directory += struct.pack("<HHHII", 0, 0, 0, mode << 16, len(body)) + encoded
        body += b"PK\3\4" + fields + encoded + data
    end = struct.pack("<HHHHIIH", 0, 0, len(names), len(names), len(directory), len(body), 0)
    return bytes(body + directory + b"PK\5\6" + end)


def _deflated(name: str, data: bytes) -> bytes:
    """Raw deflate data; for libraries and text of the model, most of an archive, the shortest that zopfli finds."""
    if name.startswith("binaries/") or name == "resources/rom.json":
        stream: bytes = zopfli.zlib.compress(data, numiterations=ITERATIONS, blocksplittingmax=BLOCKS)
        return stream[2:-4]  # without the header and the checksum of a zlib stream
    compressor = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return compressor.compress(data) + compressor.flush()


def write_archive(path: Path, files: Mapping[str, bytes]) -> tuple[int, str]:
    """Write an archive in one move; returns its size in bytes and its SHA-256."""
    content = archive_bytes(files)

    def write(temporary: Path) -> None:
        temporary.write_bytes(content)

    replace_atomically(path, write)
    return len(content), hashlib.sha256(content).hexdigest()
