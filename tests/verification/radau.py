"""Radau IIA of order five for M q'' + C q' + K q + g(q) = 0: the stiff collocation scheme of Hairer and Wanner.

Unknown are the accelerations at the three stages c h of a step,

    q_i = q + c_i h v + h^2 sum_j (a a)_ij A_j,   v_i = v + h sum_j a_ij A_j,   M A_i + C v_i + K q_i + g(q_i) = 0,

The linear operator is diagonalised over the stages (one real and one complex system, factors kept); the rest is a fixed
point with Anderson acceleration from the extrapolated accelerations of the last step. The last stage is the end of the
step. Relative errors of frequency and damping of a mode are of the order (omega h)^5 / 7200 per radian.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from romgen.arrays import FloatArray

ROOT6 = np.sqrt(6.0)
NODES = np.array([(4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0, 1.0])
WEIGHTS = np.array(
    [
        [(88.0 - 7.0 * ROOT6) / 360.0, (296.0 - 169.0 * ROOT6) / 1800.0, (-2.0 + 3.0 * ROOT6) / 225.0],
        [(296.0 + 169.0 * ROOT6) / 1800.0, (88.0 + 7.0 * ROOT6) / 360.0, (-2.0 - 3.0 * ROOT6) / 225.0],
        [(16.0 - ROOT6) / 36.0, (16.0 + ROOT6) / 36.0, 1.0 / 9.0],
    ]
)
# Quadratic through the accelerations of one step, continued to the stages of the next.
EXTRAPOLATION = np.vander(1.0 + NODES, 3) @ np.linalg.inv(np.vander(NODES, 3))
MAX_ITERATIONS, HISTORY = 60, 5


class Radau:
    """Steps of one size from any state.

    Parameters
    ----------
    matrices : M, C, K, sparse.
    force : g(q).
    h : step, s.
    tolerance : of the last change of the end state in the norm of h^2 K + M, relative to the state.
    """

    def __init__(
        self,
        matrices: tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix],
        force: Callable[[FloatArray], FloatArray],
        h: float,
        tolerance: float = 1e-8,
    ) -> None:
        self.M, self.C, self.K = matrices
        self.force, self.h, self.tolerance = force, h, tolerance
        values, T = np.linalg.eig(WEIGHTS)
        order = [int(np.argmin(np.abs(values.imag))), int(np.argmax(values.imag))]
        self.rows, self.columns = np.linalg.inv(T)[order], T[:, order]
        systems = [(self.M + h * s * self.C + h**2 * s**2 * self.K).tocsc() for s in values[order]]
        self.real, self.complex = splu(sp.csc_matrix(systems[0].real, copy=True)), splu(systems[1])
        self.iterations = 0

    def march(self, q: FloatArray, v: FloatArray, steps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return displacement, velocity and acceleration at the ends of all steps, (steps + 1, n) each."""
        state = (q, v, splu(self.M.tocsc()).solve(-(self.C @ v + self.K @ q + self.force(q))))
        A = np.tile(state[2], (3, 1))
        motion = [state]
        for _ in range(steps):
            A = self.accelerations(q, v, A)
            Q, V = self.stages(q, v, A)
            q, v = Q[2], V[2]
            motion.append((q, v, A[2]))
            A = EXTRAPOLATION @ A
        return tuple(np.array(part) for part in zip(*motion, strict=True))

    def accelerations(self, q: FloatArray, v: FloatArray, A: FloatArray) -> FloatArray:
        """Return A (3, n) of a step from its guess."""
        past: list[tuple[FloatArray, FloatArray]] = []
        size = self.h * float(np.sqrt(v @ (self.M @ v) + q @ (self.K @ q)))
        for _ in range(MAX_ITERATIONS):
            change = self.solve(-self.residual(q, v, A))
            self.iterations += 1
            if self.h * np.sqrt(max(change[2] @ (self.M @ change[2]), 0.0)) * self.h <= self.tolerance * size:
                return A + change
            past = [*past[-HISTORY:], (A, change)]
            A = accelerated(past)
        raise RuntimeError(f"no convergence: change {np.linalg.norm(change):.3g} of {np.linalg.norm(A):.3g}")

    def stages(self, q: FloatArray, v: FloatArray, A: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and velocity of the stages, (3, n) each."""
        Q = q + self.h * NODES[:, None] * v + self.h**2 * (WEIGHTS @ WEIGHTS) @ A
        return Q, v + self.h * WEIGHTS @ A

    def residual(self, q: FloatArray, v: FloatArray, A: FloatArray) -> FloatArray:
        """Return M A + C V + K Q + g(Q), (3, n)."""
        Q, V = self.stages(q, v, A)
        linear: FloatArray = self.M @ A.T + self.C @ V.T + self.K @ Q.T
        return linear.T + np.array([self.force(row) for row in Q])

    def solve(self, r: FloatArray) -> FloatArray:
        """Return the solution of the linear part for a right side r (3, n)."""
        first = self.real.solve((self.rows[0] @ r).real)
        pair = self.complex.solve(self.rows[1] @ r)
        return np.outer(self.columns[:, 0].real, first) + 2.0 * np.outer(self.columns[:, 1], pair).real


def accelerated(past: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Return the next iterate of A <- A + change by Anderson mixing of the past pairs (Walker and Ni 2011)."""
    A, change = past[-1]
    if len(past) == 1:
        return A + change
    dF = np.column_stack([(change - older).ravel() for _, older in past[:-1]])
    dA = np.column_stack([(A - older).ravel() for older, _ in past[:-1]])
    gamma = np.linalg.lstsq(dF, change.ravel(), rcond=None)[0]
    return A + change - ((dA + dF) @ gamma).reshape(A.shape)
