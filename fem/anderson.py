"""Anderson acceleration of x <- x + f(x) for several independent cases at once.

Walker & Ni, SIAM J. Numer. Anal. 49 (2011), eq. (2.1), with the least-squares problem solved by its scaled normal
equations.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from fem.arrays import FloatArray, IntArray
from fem.compiled import threaded

# Relative to the largest diagonal entry of the normal equations: keeps nearly parallel pairs from cancelling.
_REGULARISATION = 1e-10


@threaded
def _mix(
    live: IntArray,
    count: IntArray,
    dx: FloatArray,
    df: FloatArray,
    gram: FloatArray,
    f: FloatArray,
    step: FloatArray,
) -> None:
    """step = f - sum_j gamma_j (dx_j + df_j) with gamma = argmin abs(f - sum_j gamma_j df_j), for each live case."""
    for column in prange(len(live)):
        c = live[column]
        m = min(count[c], dx.shape[1])
        n = f.shape[0]
        right = np.zeros(m)
        for j in range(m):
            s = 0.0
            for i in range(n):
                s += df[c, j, i] * f[i, column]
            right[j] = s
        A = np.zeros((m, m))
        scale = np.ones(m)
        for j in range(m):
            scale[j] = 1.0 / np.sqrt(gram[c, j, j]) if gram[c, j, j] > 0.0 else 0.0
        for j in range(m):
            for k in range(m):
                A[j, k] = gram[c, j, k] * scale[j] * scale[k]
            A[j, j] += _REGULARISATION if scale[j] > 0.0 else 1.0
            right[j] *= scale[j]
        gamma = np.linalg.solve(A, right) * scale if m > 0 else right
        for i in range(n):
            s = f[i, column]
            for j in range(m):
                s -= gamma[j] * (dx[c, j, i] + df[c, j, i])
            step[i, column] = s


@threaded
def _remember(
    live: IntArray, count: IntArray, dx: FloatArray, df: FloatArray, gram: FloatArray, x: FloatArray, f: FloatArray
) -> None:
    """Put the pair (x, f) in the oldest place of each live case and update the Gram matrix of df."""
    depth = dx.shape[1]
    for column in prange(len(live)):
        c = live[column]
        place = count[c] % depth
        n = x.shape[0]
        for i in range(n):
            dx[c, place, i] = x[i, column]
            df[c, place, i] = f[i, column]
        count[c] += 1
        for j in range(min(count[c], depth)):
            s = 0.0
            for i in range(n):
                s += df[c, j, i] * df[c, place, i]
            gram[c, j, place] = s
            gram[c, place, j] = s


class Anderson:
    """History of ``depth`` pairs for ``n_case`` cases of ``n`` unknowns."""

    def __init__(self, n: int, n_case: int, depth: int) -> None:
        self.dx = np.zeros((n_case, depth, n))
        self.df = np.zeros((n_case, depth, n))
        self.gram = np.zeros((n_case, depth, depth))
        self.count = np.zeros(n_case, dtype=np.int64)

    def remember(self, live: IntArray, dx: FloatArray, df: FloatArray) -> None:
        """Add one pair to each case of ``live`` (n_live,); dx, df (n, n_live)."""
        _remember(live, self.count, self.dx, self.df, self.gram, dx, df)

    def step(self, live: IntArray, f: FloatArray) -> FloatArray:
        """Accelerated steps (n, n_live) of the cases ``live`` (n_live,) from their residuals f (n, n_live)."""
        step = np.empty_like(f)
        _mix(live, self.count, self.dx, self.df, self.gram, f, step)
        return step

    def forget(self) -> None:
        """Drop all pairs."""
        self.count[:] = 0
