"""Rows of a sparse matrix in chunks of equal work: threads that share rows out evenly wait where entries crowd."""

from __future__ import annotations

import numpy as np

from fem.arrays import IntArray

CHUNKS = 64
"""A multiple of all usual thread counts; sums are within rows, so that results do not depend on it."""


def row_chunks(pointers: IntArray) -> IntArray:
    """First row of every chunk and the number of rows, (n_chunk + 1,), from row pointers (n_row + 1,).

    A row counts as its entries and one.
    """
    work = pointers.astype(np.int64) + np.arange(len(pointers))
    inner = np.searchsorted(work, np.linspace(0.0, work[-1], CHUNKS + 1)[1:-1])
    return np.concatenate([[0], inner, [len(pointers) - 1]]).astype(np.int64)
