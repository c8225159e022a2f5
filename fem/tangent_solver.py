"""Newton steps with a consistent tangent, most of them without a factor of their own.

The tangent is unsymmetric where points slip, and its factor costs three to five times that of a symmetric one. Here a
symmetric positive definite factor of an earlier tangent preconditions GMRES on the current one, together with the rows
and columns of side conditions; the factor is renewed where the iterations grow.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import LinearSolver, make_solver

RELATIVE = 1e-5
"""Residual at which a linear system counts as solved: Newton then still gains four to five digits per step."""

PATIENCE = 40
"""Iterations after which a new factor is cheaper than going on."""


class TangentSolver:
    """Solves [[K, -L], [L', 0]] (x, y) = (r, m) for tangents K that change little from call to call.

    Parameters
    ----------
    border : (n_dof, n_side) L, zero in supported degrees of freedom.
    """

    def __init__(self, border: FloatArray, solver: str) -> None:
        self._border, self._name = border, solver
        self._factor: LinearSolver | None = None
        self._spread = self._small = border
        self.factors = self.iterations = 0

    def forget(self) -> None:
        """Take a new factor with the next tangent."""
        self._factor = None

    def solve(
        self,
        tangent: sp.csr_matrix,
        symmetric: Callable[[], sp.csr_matrix],
        residual: FloatArray,
        miss: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """x (n_dof,) and y (n_side,) for r (n_dof,) and m (n_side,).

        ``symmetric`` gives a positive definite matrix close to the tangent; where it is none after all, the tangent
        itself is factored. A singular tangent raises ``FemConvergenceError``.
        """
        right = np.concatenate([residual, miss])
        for fresh in (False, True):
            if self._factor is None or fresh:
                self._renew(tangent, symmetric)
            solution, converged = self._gmres(tangent, right)
            if converged:
                return solution[: len(residual)], solution[len(residual) :]
        direct = self._factored(tangent, symmetric=False)
        self._adopt(direct)
        solution = self._precondition(right)
        return solution[: len(residual)], solution[len(residual) :]

    def _gmres(self, tangent: sp.csr_matrix, right: FloatArray) -> tuple[FloatArray, bool]:
        n, border = tangent.shape[0], self._border

        def product(vector: FloatArray) -> FloatArray:
            x, y = vector[:n], vector[n:]
            return np.concatenate([tangent @ x - border @ y, border.T @ x])

        count = [0]

        def counted(_: float) -> None:
            count[0] += 1

        # Right preconditioning: GMRES then measures the residual itself, not a preconditioned one.
        shape = (len(right), len(right))
        operator = spla.LinearOperator(shape, matvec=lambda v: product(self._precondition(v)), dtype=float)
        found, status = spla.gmres(
            operator, right, rtol=RELATIVE, restart=PATIENCE, maxiter=1, callback=counted, callback_type="pr_norm"
        )
        self.iterations += count[0]
        return self._precondition(found), status == 0

    def _precondition(self, vector: FloatArray) -> FloatArray:
        """Bordered elimination on the factor."""
        assert self._factor is not None
        n = len(vector) - self._border.shape[1]
        plain = self._factor.solve(vector[:n])
        if not self._border.shape[1]:
            return plain
        y = np.linalg.solve(self._small, vector[n:] - self._border.T @ plain)
        return np.concatenate([plain + self._spread @ y, y])

    def _renew(self, tangent: sp.csr_matrix, symmetric: Callable[[], sp.csr_matrix]) -> None:
        try:
            self._adopt(self._factored(symmetric(), symmetric=True))
        except FemConvergenceError:
            # Not positive definite, such as beyond a limit load.
            self._adopt(self._factored(tangent, symmetric=False))

    def _factored(self, matrix: sp.csr_matrix, *, symmetric: bool) -> LinearSolver:
        direct = make_solver(self._name, symmetric=symmetric)
        direct.analyse(matrix)
        direct.factor(matrix)
        self.factors += 1
        return direct

    def _adopt(self, direct: LinearSolver) -> None:
        self._factor = direct
        if self._border.shape[1]:
            self._spread = direct.solve(self._border)
            self._small = self._border.T @ self._spread
