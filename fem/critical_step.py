"""The largest stable step of explicit central differences."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fem.arrays import FloatArray
from fem.errors import FemInputError
from fem.model import Model
from fem.modes import Rayleigh

_ACCURACY = 1e-3
"""Relative accuracy of the largest eigenvalue; the step allows for it."""


def critical_step(model: Model, u: FloatArray, mass: FloatArray, damping: Rayleigh) -> float:
    """h = 2/omega (sqrt(1 + xi^2) - xi) in s, omega the highest frequency, xi = (alpha/omega + beta omega)/2.

    omega^2 is the largest eigenvalue of M^-1 K by Lanczos, K the tangent at u (n_dof,) m with all contact points closed
    and stuck, M the lumped ``mass`` (n_dof,) kg. A massless degree of freedom raises ``FemInputError``.

    Source: Belytschko, Liu, Moran, Nonlinear Finite Elements for Continua and Structures, sec. 6.2.
    """
    free = np.flatnonzero(model.free)
    if np.any(mass[free] <= 0.0):
        bad = int(free[mass[free].argmin()])
        advice = "give every body a density"
        raise FemInputError(
            "no mass", where=f"node {bad // 3}, direction {'xyz'[bad % 3]}", value=float(mass[bad]), advice=advice
        )
    closed = np.ones(model.contact.n_point, dtype=np.int64)
    stiffness = (model.elastic_tangent(u) + model.contact.stick_tangent(closed))[free][:, free]
    root = sp.diags(1.0 / np.sqrt(mass[free]))
    # Shakes all nodes against each other: a start with a share of the shortest waves.
    start = np.cos(np.arange(len(free)) * 2.0)
    square = spla.eigsh(root @ stiffness @ root, 1, which="LA", v0=start, tol=_ACCURACY, return_eigenvectors=False)
    omega = float(np.sqrt((1.0 + _ACCURACY) * square[0]))
    xi = 0.5 * (damping.alpha / omega + damping.beta * omega)
    return float(2.0 / omega * (np.hypot(1.0, xi) - xi))
