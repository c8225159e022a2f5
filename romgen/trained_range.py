"""Where the training motions were: a convex set of modal amplitudes with a distance measure.

With rho = (abs(z_1), .., abs(z_m)) the range is the convex hull of the amplitudes that the training motions passed
through and of everything below them (what was reached together with another mode counts as trained without it):

    R = conv {rho' : 0 <= rho' <= rho(t_k), t_k a training sample} = {rho >= 0 : n_k . rho <= 1 for all facets k},

with n_k >= 0. Its gauge (Minkowski functional) is the distance measure,

    d(rho) = max_k n_k . rho:  d <= 1 inside,  d(c rho) = c d(rho),  d never falls when an amplitude grows.

Two modes that were never large together are trained up to the line between them, not up to the corner of their
largest amplitudes. Source: Rockafellar 1970, Convex Analysis, sec. 15 (gauges).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import ConvexHull

from romgen.arrays import BoolArray, ComplexArray, FloatArray
from romgen.errors import NumericalError

# Amplitudes are rounded up to this share of the largest of their mode: a facet costs time in every step of an FMU. With
# three modes and more a finer grid would give hundreds of facets.
GRID_TWO, GRID_MORE = 0.01, 0.1
# A point on the boundary counts as inside.
ROUNDING = 1e-9


@dataclass(frozen=True)
class TrainedRange:
    """The trained amplitudes as facets.

    Attributes
    ----------
    facets : (n_facet, m) n_k >= 0.
    """

    facets: FloatArray = field(metadata={"unit": "1", "axes": "facet,mode"})

    def distance(self, z: ComplexArray | FloatArray) -> FloatArray:
        """Return d (n,) of states or amplitudes z (n, m); nan where a state is nan.

        Equation: d = max_k n_k . abs(z). No unit.
        """
        d: FloatArray = np.max(np.abs(z) @ self.facets.T, axis=-1)
        return d

    def exceeded(self, z: ComplexArray | FloatArray) -> BoolArray:
        """Whether states or amplitudes z (n, m) lie outside, (n,): d > 1."""
        outside: BoolArray = ~(self.distance(z) <= 1.0 + ROUNDING)
        return outside

    @property
    def amplitude(self) -> FloatArray:
        """Largest amplitude of each mode alone, (m,)."""
        largest: FloatArray = 1.0 / self.facets.max(axis=0)
        return largest


def box_range(amplitude: FloatArray) -> TrainedRange:
    """Return the range rho_j <= amplitude_j (m,), d = max_j rho_j / amplitude_j: what is taken without motions."""
    return TrainedRange(np.diag(1.0 / amplitude))


def trained_range(z: ComplexArray) -> TrainedRange:
    """Return the range of the training states.

    Parameters
    ----------
    z : (n_sample, m) all training motions stacked; samples that are not finite do not count.

    Raises
    ------
    NumericalError : no sample is finite.
    """
    rho = np.abs(z[np.isfinite(z).all(axis=1)])
    if len(rho) == 0:
        raise NumericalError("the model diverges on all training motions", where="trained range", value=len(z))
    m = rho.shape[1]
    largest = np.maximum(rho.max(axis=0), np.finfo(float).tiny)
    grid = GRID_TWO if m <= 2 else GRID_MORE
    points = np.unique(np.ceil(rho / largest / grid - ROUNDING) * grid, axis=0)
    facets = _facets(np.vstack([points, np.eye(m)]))
    return TrainedRange(facets / largest)


def _facets(points: FloatArray) -> FloatArray:
    """Return n_k (n_facet, m) of the hull of the points (n, m) >= 0 and everything below; the axes reach 1."""
    m = points.shape[1]
    if m == 1:
        return np.ones((1, 1))
    # everything below a point: its projections on all coordinate planes
    masks = (np.arange(2**m)[:, None] >> np.arange(m)) & 1
    corners = np.unique((points[:, None, :] * masks[None]).reshape(-1, m), axis=0)
    equations = ConvexHull(corners).equations
    outer = equations[equations[:, m] < -ROUNDING]
    normals = np.maximum(outer[:, :m] / -outer[:, m:], 0.0)
    unique: FloatArray = np.unique(np.round(normals, 9), axis=0)
    return unique
