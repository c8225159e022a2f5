"""How far a residual can fall: rounding of the displacement itself leaves forces in a stiff body."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.model import Model

STALLED = 0.5
"""A residual that an iteration leaves above this share of the one before no longer falls as Newton's should."""

LARGEST = 1e-3
"""Share of the forces above which no residual is taken for rounding."""


def rounding_force(model: Model, u: FloatArray, slip: FloatArray) -> float:
    """Norm of eps abs(K) abs(u) over the free degrees of freedom, N: the forces that rounding u once may change.

    The forces that a thin part takes to be stretched by its own deflection are far larger than the load, and their
    rounding is all that is left of a residual: 1e-6 of its weight in a strip of 300 x 1 mm. An iterate whose residual
    has stalled below this bound is as good as any other.

    Parameters
    ----------
    u : (n_dof,) m; slip : (n_point, 2) m, history at the beginning of the step.

    Source: Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 3.5, the bound of a product K u.
    """
    K = (model.elastic_tangent(u) + model.contact.tangent(u, slip)).tocsr()
    np.abs(K.data, out=K.data)
    return float(np.finfo(float).eps * np.linalg.norm((K @ np.abs(u))[model.free]))


def is_rounding(model: Model, u: FloatArray, slip: FloatArray, sizes: tuple[float, float, float]) -> bool:
    """Whether the residual at u has stalled at what rounding leaves.

    Parameters
    ----------
    slip : (n_point, 2, 1) m, history at the beginning of the step.
    sizes : of the residual, of that one iteration before, and of the forces that it is out of balance with, N. A
        residual above LARGEST of these is no rounding however far u has run away.
    """
    size, last, scale = sizes
    if not (STALLED * last < size < last / STALLED and size <= LARGEST * scale):
        return False
    return size <= rounding_force(model, u, slip[:, :, 0])
