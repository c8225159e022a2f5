"""One run at a time in a run folder; the system drops the lock when the process dies, however it dies."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from romgen.errors import InputError

if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: IO[bytes]) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _try_lock(file: IO[bytes]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def locked(run_dir: Path) -> Iterator[None]:
    """Hold the run folder for the enclosed block.

    Raises
    ------
    InputError : another process runs in this folder.
    """
    run_dir.mkdir(parents=True, exist_ok=True)
    with open(run_dir / ".lock", "ab") as file:
        try:
            _try_lock(file)
        except OSError as error:
            raise InputError(
                "another romgen run works in this folder", where=str(run_dir), advice="wait for it or choose --run-dir"
            ) from error
        yield
