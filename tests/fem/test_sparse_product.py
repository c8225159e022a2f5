"""Threaded sparse products, and the chunks of equal work that threads take."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from fem.row_chunks import CHUNKS, row_chunks
from fem.sparse_product import SparseProduct


@pytest.mark.parametrize("n_case", [1, 3])
def test_product_is_that_of_the_matrix(n_case: int) -> None:
    rng = np.random.default_rng(5)
    matrix = sp.random(200, 30, 0.1, random_state=rng, format="csr")
    x = rng.standard_normal((30, n_case))
    np.testing.assert_allclose(SparseProduct(matrix)(x), matrix @ x, atol=1e-14)


def test_no_rows_and_no_entries() -> None:
    assert SparseProduct(sp.csr_matrix((0, 4)))(np.ones((4, 1))).shape == (0, 1)
    assert not SparseProduct(sp.csr_matrix((7, 4)))(np.ones((4, 2))).any()


@pytest.mark.parametrize("n_row", [0, 1, 10, 5000])
def test_chunks_hold_every_row_once_and_equal_work(n_row: int) -> None:
    """All entries crowd in the last tenth of the rows: a chunk exceeds its share of the work by one row at most."""
    entries = np.where(np.arange(n_row) >= 0.9 * n_row, 50, 0)
    pointers = np.concatenate([[0], np.cumsum(entries)])
    chunks = row_chunks(pointers)
    assert chunks[0] == 0
    assert chunks[-1] == n_row
    assert np.all(np.diff(chunks) >= 0)
    work = np.add.reduceat(np.append(entries + 1, 0), chunks[:-1]) * (np.diff(chunks) > 0)
    assert work.sum() == (entries + 1).sum()
    assert work.max(initial=0) <= (entries + 1).sum() / CHUNKS + 51
