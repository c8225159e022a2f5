"""The manifold x = W (y / s)^E by ridge regression on streamed Gram blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from romgen.arrays import FloatArray, IntArray
from romgen.errors import InputError
from romgen.polynomial import monomials
from romgen.regression import ridge_solve

FloatBlock = npt.NDArray[np.float32] | FloatArray
# Columns of the observed vector that are lifted together; bounds the memory of full fields.
BLOCK_BYTES = 64_000_000


@dataclass(frozen=True)
class Manifold:
    """The graph of the manifold over its reduced coordinates, x = W (y / s)^E.

    Attributes
    ----------
    exponents : (n_term, 2m), degree 1 upwards.
    coefficients : (n_out, n_term) W.
    scale : (2m,) s, the unit of each y.
    """

    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,coordinate"})
    coefficients: FloatArray = field(metadata={"unit": "unit of x", "axes": "dof,term"})
    scale: FloatArray = field(metadata={"unit": "mixed", "axes": "coordinate"})


class ManifoldFit:
    """Accumulates Phi' Phi and Phi' X over blocks of samples, so that snapshots need not fit in memory.

    Parameters
    ----------
    n_out : rows of x.
    exponents : (n_term, 2m).
    scale : (2m,) s.
    linear : (n_out, 2m) known linear part in x per y (modes), or None to fit it.
    """

    def __init__(self, n_out: int, exponents: IntArray, scale: FloatArray, linear: FloatArray | None = None) -> None:
        self._exponents, self._scale, self._linear = exponents, scale, linear
        fitted = np.ones(len(exponents), dtype=bool) if linear is None else exponents.sum(axis=1) > 1
        self._fitted = np.flatnonzero(fitted)
        self._gram = np.zeros((len(self._fitted), len(self._fitted)))
        self._cross = np.zeros((len(self._fitted), n_out))
        self._samples = 0

    def add(self, x: FloatBlock, y: FloatArray) -> None:
        """Add samples x (n, n_out), single or double precision, at y (n, 2m)."""
        if x.shape != (len(y), self._cross.shape[1]):
            raise InputError("block does not fit", where="manifold", value=(x.shape, y.shape))
        phi = monomials(y / self._scale, self._exponents[self._fitted])
        target = x if self._linear is None else x - y @ self._linear.T
        self._gram += phi.T @ phi
        self._cross += phi.T @ target
        self._samples += len(y)

    def finish(self, ridge: float) -> Manifold:
        """Return the manifold; ``ridge`` as in ``regression.ridge_solve``."""
        n_out = self._cross.shape[1]
        coefficients = np.zeros((n_out, len(self._exponents)))
        coefficients[:, self._fitted] = ridge_solve(self._gram, self._cross, self._samples, ridge)
        if self._linear is not None:
            known = np.flatnonzero(self._exponents.sum(axis=1) == 1)
            coefficients[:, known] = self._linear @ (self._scale[:, None] * self._exponents[known].T)
        return Manifold(self._exponents, coefficients, self._scale)


def lift(manifold: Manifold, y: FloatArray) -> FloatArray:
    """Return x = W (y / s)^E, (n_time, n_out), of y (n_time, 2m)."""
    x: FloatArray = monomials(y / manifold.scale, manifold.exponents) @ manifold.coefficients.T
    return x


def nmte_blocks(manifold: Manifold, x: FloatBlock, y: FloatArray) -> float:
    """Return the NMTE in percent of the lifted y against x (n, n_out), in blocks that bound the memory.

    With y projected from x itself this is the static error of the manifold; with y simulated, the error of the model.
    """
    rows = max(1, BLOCK_BYTES // (8 * x.shape[1]))
    misfit, largest = 0.0, 0.0
    for first in range(0, len(y), rows):
        block = np.asarray(x[first : first + rows], dtype=np.float64)
        misfit += float(np.linalg.norm(block - lift(manifold, y[first : first + rows]), axis=1).sum())
        largest = max(largest, float(np.linalg.norm(block, axis=1).max()))
    return 100.0 * misfit / (len(y) * largest)
