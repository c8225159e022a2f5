"""Archives whose bytes depend on their content only."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

from romgen.store import replace_atomically

DATE = (1980, 1, 1, 0, 0, 0)
UNIX = 3


def archive_bytes(files: Mapping[str, bytes]) -> bytes:
    """A ZIP archive with sorted names, fixed dates and modes, deflated."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, DATE)
            entry.create_system = UNIX
            entry.external_attr = (0o100755 if name.startswith("binaries/") else 0o100644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name], compresslevel=9)
    return buffer.getvalue()


def write_archive(path: Path, files: Mapping[str, bytes]) -> tuple[int, str]:
    """Write an archive in one move; returns its size in bytes and its SHA-256."""
    content = archive_bytes(files)

    def write(temporary: Path) -> None:
        temporary.write_bytes(content)

    replace_atomically(path, write)
    return len(content), hashlib.sha256(content).hexdigest()
