"""Wall time and peak memory of a stage."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

if sys.platform != "win32":
    import resource

SAMPLE_INTERVAL_S = 0.02
_STATM = Path("/proc/self/statm")


@dataclass
class Usage:
    """What a stage took; filled when the block of ``measured`` ends."""

    wall_s: float = 0.0
    peak_memory_bytes: int = 0


@contextmanager
def measured() -> Iterator[Usage]:
    """Measure the enclosed block.

    The peak is the largest resident memory of this process among samples every 20 ms where the system shows it
    (Linux), raised to the process' high-water mark when that grew inside the block; elsewhere the mark alone.
    """
    usage, stop = Usage(), threading.Event()
    before = _high_water_bytes()
    sampler = threading.Thread(target=_sample, args=(usage, stop), daemon=True)
    start = time.perf_counter()
    sampler.start()
    try:
        yield usage
    finally:
        stop.set()
        sampler.join()
        usage.wall_s = time.perf_counter() - start
        after = _high_water_bytes()
        if after > before or usage.peak_memory_bytes == 0:
            usage.peak_memory_bytes = max(after, usage.peak_memory_bytes)


def _sample(usage: Usage, stop: threading.Event) -> None:
    while True:
        usage.peak_memory_bytes = max(usage.peak_memory_bytes, resident_bytes())
        if stop.wait(SAMPLE_INTERVAL_S):
            return


def resident_bytes() -> int:
    """Resident memory of this process in bytes now; 0 where the system has no /proc."""
    if sys.platform == "win32" or not _STATM.exists():
        return 0
    return int(_STATM.read_text().split()[1]) * resource.getpagesize()


def _high_water_bytes() -> int:
    if sys.platform == "win32":
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak) if sys.platform == "darwin" else 1024 * int(peak)
