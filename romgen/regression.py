"""Ridge regression from Gram blocks: only Phi' Phi and Phi' X are ever held."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Scalar = TypeVar("Scalar", np.float64, np.complex128)


def ridge_solve(
    gram: npt.NDArray[Scalar], cross: npt.NDArray[Scalar], n_sample: int, ridge: float
) -> npt.NDArray[Scalar]:
    """Return C minimising the mean of abs(x - C phi)^2 + ridge sum_k r_k^2 abs(C_k)^2, r_k the RMS of monomial k.

    Columns are scaled to RMS 1 first, so ``ridge`` has no unit; directions below rounding are left out.

    Parameters
    ----------
    gram : (n_term, n_term) Phi^H Phi.
    cross : (n_term, n_out) Phi^H X.
    n_sample : number of samples in both sums.

    Returns
    -------
    (n_out, n_term)
    """
    rms = np.sqrt(np.maximum(np.diag(gram).real / n_sample, np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(gram / np.outer(rms, rms) / n_sample)
    floor = len(values) * np.finfo(float).eps * max(float(values[-1]), np.finfo(float).tiny)
    inverse = np.where(values > floor, 1.0 / (np.maximum(values, floor) + ridge), 0.0)
    scaled = vectors @ (inverse[:, None] * (vectors.conj().T @ (cross / rms[:, None] / n_sample)))
    solution: npt.NDArray[Scalar] = (scaled / rms[:, None]).T
    return solution


def ridge_fit(phi: npt.NDArray[Scalar], x: npt.NDArray[Scalar], ridge: float) -> npt.NDArray[Scalar]:
    """Return C (n_out, n_term) of x ~ C phi for phi (n_time, n_term) and x (n_time, n_out); see ``ridge_solve``."""
    adjoint = phi.conj().T
    return ridge_solve(adjoint @ phi, adjoint @ x, len(phi), ridge)
