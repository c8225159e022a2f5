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
def _weights(
    live: IntArray, count: IntArray, df: FloatArray, gram: FloatArray, f: FloatArray, gamma: FloatArray
) -> None:
    """gamma (n_live, depth) = argmin abs(f - sum_j gamma_j df_j) for each live case; 0 for places without a pair."""
    for column in prange(len(live)):
        c = live[column]
        m = min(count[c], df.shape[1])
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
        gamma[column] = 0.0
        if m > 0:
            gamma[column, :m] = np.linalg.solve(A, right) * scale


@threaded
def _mix(
    live: IntArray,
    count: IntArray,
    gamma: FloatArray,
    dx: FloatArray,
    df: FloatArray,
    f: FloatArray,
    step: FloatArray,
) -> None:
    """step = f - sum_j gamma_j (dx_j + df_j) for each live case."""
    for column in prange(len(live)):
        c = live[column]
        m = min(count[c], dx.shape[1])
        for i in range(f.shape[0]):
            s = f[i, column]
            for j in range(m):
                s -= gamma[column, j] * (dx[c, j, i] + df[c, j, i])
            step[i, column] = s


@threaded
def _store(live: IntArray, count: IntArray, dx: FloatArray, df: FloatArray, x: FloatArray, f: FloatArray) -> None:
    """Put the pair (x, f) in the oldest place of each live case."""
    for column in prange(len(live)):
        c = live[column]
        place = count[c] % dx.shape[1]
        for i in range(x.shape[0]):
            dx[c, place, i] = x[i, column]
            df[c, place, i] = f[i, column]


@threaded
def _count(live: IntArray, count: IntArray, df: FloatArray, gram: FloatArray) -> None:
    """Count the pair just stored, and update the Gram matrix of df."""
    depth = df.shape[1]
    for column in prange(len(live)):
        c = live[column]
        place = count[c] % depth
        count[c] += 1
        for j in range(min(count[c], depth)):
            s = 0.0
            for i in range(df.shape[2]):
                s += df[c, j, i] * df[c, place, i]
            gram[c, j, place] = s
            gram[c, place, j] = s


class Anderson:
    """History of ``depth`` pairs for ``n_case`` cases of ``n`` unknowns.

    Further unknowns may be carried along: they are mixed with the same weights, but decide nothing.
    """

    def __init__(self, n: int, n_case: int, depth: int) -> None:
        self.dx = np.zeros((n_case, depth, n))
        self.df = np.zeros((n_case, depth, n))
        self.gram = np.zeros((n_case, depth, depth))
        self.count = np.zeros(n_case, dtype=np.int64)
        self._carried = (np.zeros((n_case, depth, 0)), np.zeros((n_case, depth, 0)))
        self._gamma = np.zeros((n_case, depth))

    def forget(self, n_carried: int = 0) -> None:
        """Drop all pairs; from now on ``n_carried`` unknowns are carried along."""
        self.count[:] = 0
        n_case, depth, _ = self.dx.shape
        if self._carried[0].shape[2] != n_carried:
            self._carried = (np.zeros((n_case, depth, n_carried)), np.zeros((n_case, depth, n_carried)))

    def remember(
        self, live: IntArray, dx: FloatArray, df: FloatArray, carried: tuple[FloatArray, FloatArray] | None = None
    ) -> None:
        """Add one pair to each case of ``live`` (n_live,); dx, df (n, n_live), carried (n_carried, n_live) both."""
        _store(live, self.count, self.dx, self.df, dx, df)
        if carried is not None:
            _store(live, self.count, *self._carried, *carried)
        _count(live, self.count, self.df, self.gram)

    def step(self, live: IntArray, f: FloatArray) -> FloatArray:
        """Accelerated steps (n, n_live) of the cases ``live`` (n_live,) from their residuals f (n, n_live)."""
        self._gamma = np.empty((len(live), self.df.shape[1]))
        _weights(live, self.count, self.df, self.gram, f, self._gamma)
        step = np.empty_like(f)
        _mix(live, self.count, self._gamma, self.dx, self.df, f, step)
        return step

    def carried_step(self, live: IntArray, f: FloatArray) -> FloatArray:
        """Steps (n_carried, n_live) of what is carried along, with the weights of the last ``step``."""
        step = np.empty_like(f)
        _mix(live, self.count, self._gamma, *self._carried, f, step)
        return step
