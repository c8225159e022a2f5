"""Wall time and memory of a block."""

from __future__ import annotations

import mmap
import time

import pytest

from romgen.resources import SAMPLE_INTERVAL_S, measured, resident_bytes


@pytest.mark.skipif(resident_bytes() == 0, reason="this system does not show resident memory")
def test_peak_of_memory_that_is_freed_inside_the_block() -> None:
    size = 128 * 2**20
    # Mapped by hand: an allocator that kept what earlier tests freed would hand that out without a new page.
    before = resident_bytes()
    with measured() as usage, mmap.mmap(-1, size) as block:
        block.write(b"1" * size)
        time.sleep(40 * SAMPLE_INTERVAL_S)  # a busy machine may starve the sampler
    assert usage.peak_memory_bytes >= before + 0.9 * size
    with measured() as idle:
        time.sleep(2 * SAMPLE_INTERVAL_S)
    assert idle.peak_memory_bytes < usage.peak_memory_bytes - 0.5 * size


def test_wall_time_also_when_the_block_fails() -> None:
    usages = []

    def failing_block() -> None:
        with measured() as usage:
            usages.append(usage)
            time.sleep(0.05)
            raise ValueError("on purpose")

    with pytest.raises(ValueError, match="on purpose"):
        failing_block()
    assert usages[0].wall_s >= 0.05
