"""GMRES for small dense systems inside compiled loops."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.compiled import compiled

STEPS, TOLERANCE = 40, 1e-2


@compiled
def _rotated(upper: FloatArray, cosines: FloatArray, sines: FloatArray, k: int) -> float:
    """Apply the rotations so far to column k of the Hessenberg matrix; the length of what the next one joins."""
    last: float = upper[k + 1, k]
    for j in range(k):
        a, b = upper[j, k], upper[j + 1, k]
        upper[j, k], upper[j + 1, k] = cosines[j] * a + sines[j] * b, cosines[j] * b - sines[j] * a
    length: float = np.sqrt(upper[k, k] ** 2 + last**2)
    return length


@compiled
def _combined(basis: FloatArray, upper: FloatArray, g: FloatArray, used: int) -> FloatArray:
    """x = sum_k y_k v_k with the triangular system R y = g."""
    x = np.zeros(basis.shape[1])
    for k in range(used - 1, -1, -1):
        y = g[k]
        for j in range(k + 1, used):
            y -= upper[k, j] * g[j]
        g[k] = y / upper[k, k]
        x += g[k] * basis[k]
    return x


@compiled
def gmres(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """x with A x = b to a relative residual of TOLERANCE.

    Saad & Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869, algorithm 4 without restarts.
    """
    n = len(right)
    size = np.sqrt(np.sum(right * right))
    if size == 0.0:
        return np.zeros(n)
    most = min(STEPS, n)
    basis, upper = np.empty((most + 1, n)), np.zeros((most + 1, most))
    cosines, sines, g = np.empty(most), np.empty(most), np.zeros(most + 1)
    basis[0] = right / size
    g[0] = size
    used = 0
    for k in range(most):
        w = np.empty(n)
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += matrix[i, j] * basis[k, j]
            w[i] = s
        for j in range(k + 1):
            upper[j, k] = np.sum(w * basis[j])
            w -= upper[j, k] * basis[j]
        upper[k + 1, k] = np.sqrt(np.sum(w * w))
        last = upper[k + 1, k]
        length = _rotated(upper, cosines, sines, k)
        if length == 0.0:
            break
        cosines[k], sines[k] = upper[k, k] / length, last / length
        upper[k, k] = length
        g[k], g[k + 1] = cosines[k] * g[k], -sines[k] * g[k]
        used = k + 1
        if abs(g[k + 1]) <= TOLERANCE * size or last == 0.0:
            break
        basis[k + 1] = w / last
    return _combined(basis, upper, g, used)
