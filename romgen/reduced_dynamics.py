"""Polynomial reduced dynamics w' = R w^{1..f} of scaled coordinates w = y / s, and its modal directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import ReducedTrajectory
from romgen.errors import NumericalError
from romgen.polynomial import PolynomialMap, exponents, monomials
from romgen.regression import ridge_fit

# The largest modal amplitude abs(q_j) in the training data after scaling.
LARGEST_AMPLITUDE = 0.5


@dataclass(frozen=True)
class ReducedDynamics:
    """The fitted vector field and the linear change q = (V^-1 w)_{1..m} to its modes.

    Attributes
    ----------
    scale : (2m,) s, largest abs(y) of the training data.
    vector_field : R, (2m, n_term) over w, 1/s; the rows of eta' = eta' are exact.
    eigenvalues : (m,) 1/s, positive imaginary parts, ascending.
    vectors : (2m, m) first half of V; w = 2 Re(V q), scaled so that max abs(q_j) = 0.5.
    inverse : (m, 2m) first rows of V^-1.
    """

    scale: FloatArray = field(metadata={"unit": "mixed", "axes": "coordinate"})
    vector_field: PolynomialMap[np.float64]
    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    vectors: ComplexArray = field(metadata={"unit": "1", "axes": "coordinate,mode"})
    inverse: ComplexArray = field(metadata={"unit": "1", "axes": "mode,coordinate"})


@dataclass(frozen=True)
class LinearPart:
    """Known modes: eta_j'' = -omega_j^2 eta_j - 2 zeta_j omega_j eta_j' at small amplitude.

    A polynomial of finite order bends its linear part towards the motions of large amplitude; where the modes of a
    finite-element model are known, the limit of small amplitude is not left to the regression.

    Attributes
    ----------
    omega : (m,) rad/s, ascending; damping_ratio : (m,).
    """

    omega: FloatArray = field(metadata={"unit": "rad/s", "axes": "mode"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "mode"})

    def rows(self, scale: FloatArray) -> FloatArray:
        """Return the rows (m, 2m) of w'' for w = y / scale, 1/s."""
        m = len(self.omega)
        stiffness = np.diag(-(self.omega**2) * scale[:m] / scale[m:])
        return np.hstack([stiffness, np.diag(-2.0 * self.damping_ratio * self.omega)])


def fit_reduced_dynamics(
    training: Sequence[ReducedTrajectory], order: int, ridge: float, known: LinearPart | None = None
) -> ReducedDynamics:
    """Fit eta'' = r(eta, eta') by ridge regression; eta' = eta' needs no fit.

    Parameters
    ----------
    training : trajectories in reduced coordinates.
    order : f, largest degree.
    ridge : as in ``regression.ridge_solve``.
    known : linear part to keep; None fits it too.

    Raises
    ------
    NumericalError : fewer samples than terms, or the linear part has not m decaying oscillations.
    """
    y, y_dot = np.vstack([r.y for r in training]), np.vstack([r.y_dot for r in training])
    m = y.shape[1] // 2
    scale = np.abs(y).max(axis=0)
    table = exponents(2 * m, 1, order)
    phi = monomials(y / scale, table)
    _check_enough(phi, order)
    R = np.zeros((2 * m, len(table)))
    R[np.arange(m), m + np.arange(m)] = scale[m:] / scale[:m]
    first = 0 if known is None else 2 * m
    if known is not None:
        R[m:, :first] = known.rows(scale)
    R[m:, first:] = ridge_fit(phi[:, first:], y_dot[:, m:] / scale[m:] - phi[:, :first] @ R[m:, :first].T, ridge)
    eigenvalues, V = decaying_modes(R[:, : 2 * m])
    amplitude = np.abs((y / scale) @ np.linalg.inv(V).T).max(axis=0)
    V = V * (amplitude / LARGEST_AMPLITUDE)
    return ReducedDynamics(scale, PolynomialMap(table, R), eigenvalues, V[:, :m], np.linalg.inv(V)[:m])


def _check_enough(phi: FloatArray, order: int) -> None:
    """Refuse fewer samples than terms; the condition number is that of the monomials scaled to RMS 1."""
    n_sample, n_term = phi.shape
    if n_sample >= n_term:
        return
    singular = np.linalg.svd(phi / np.sqrt(np.mean(phi**2, axis=0)), compute_uv=False)
    raise NumericalError(
        f"too little data for order {order}: {n_sample} samples for {n_term} terms",
        where="reduced dynamics",
        value=f"condition number {singular[0] / max(singular[-1], np.finfo(float).tiny):.2g}",
        advice="lower [learn] order, start_time, or give more training data",
    )


def decaying_modes(A: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return eigenvalues (m,) with Im > 0, ascending, and all vectors (2m, 2m): m columns, then their conjugates.

    Raises
    ------
    NumericalError : an eigenvalue is real or does not decay.
    """
    values, vectors = np.linalg.eig(A)
    upper = np.flatnonzero(values.imag > 0)
    if 2 * len(upper) != len(A) or np.any(values.real >= 0):
        raise NumericalError(
            "the fitted linear part is not that of decaying oscillations",
            where="reduced dynamics",
            value=values,
            advice="give longer or cleaner training decays, a later start_time, or a lower order",
        )
    order = upper[np.argsort(values.imag[upper])]
    V = vectors[:, order].astype(np.complex128)
    return values[order].astype(np.complex128), np.hstack([V, V.conj()])


def modal_samples(dynamics: ReducedDynamics, trajectory: ReducedTrajectory) -> tuple[ComplexArray, ComplexArray]:
    """Return q and q', (n_time, m), of a trajectory."""
    q: ComplexArray = (trajectory.y / dynamics.scale) @ dynamics.inverse.T
    q_dot: ComplexArray = (trajectory.y_dot / dynamics.scale) @ dynamics.inverse.T
    return q, q_dot
