"""Pressures that stay normal to a surface while it moves, with their load stiffness.

    P_a = -p int N_a (x_,xi x x_,eta) dxi deta,   x = X + u
    dP_ai/du_bj = -p int N_a e_ijk (N_b,xi x_,eta - N_b,eta x_,xi)_k dxi deta

The load stiffness is symmetric where the surface is closed, or ends at supports that keep its volume; otherwise a free
edge makes it unsymmetric and the load has no potential. Newton steps take it as it is.

Source: Schweizerhof & Ramm, Comput. Struct. 18 (1984) 1099-1114.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.body import Body, locate
from fem.finite_values import finite_number
from fem.loads import FollowerPressure, Load
from fem.pairing import face_element

_LEVI_CIVITA = np.zeros((3, 3, 3))
_LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


@dataclass(frozen=True)
class _Patch:
    """Facets (n_facet, n_local) over nodes of the model, and the pressure on them in Pa."""

    facets: IntArray
    pressure: float


@dataclass(frozen=True)
class FollowerSet:
    """All follower pressures of a model; ``factor`` is the share of them that acts.

    Attributes
    ----------
    points : (n_node, 3) m of the undeformed structure.
    """

    patches: tuple[_Patch, ...]
    points: FloatArray
    factor: float = 1.0

    @property
    def any(self) -> bool:
        """Whether there is one that acts."""
        return bool(self.patches) and self.factor != 0.0

    def scaled(self, factor: float) -> FollowerSet:
        """The same pressures with another share of them acting."""
        return replace(self, factor=factor)

    def force(self, u: FloatArray) -> FloatArray:
        """Nodal forces (n_dof, n_case) N at u (n_dof, n_case) m."""
        total = np.zeros((len(self.points), 3, u.shape[1]))
        for patch in self.patches:
            x, w = face_element(patch.facets).mass_rule()
            shape, slope = face_element(patch.facets).shape(x)
            place = self._placed(u, patch.facets)
            along = np.einsum("qad,faic->dfqic", slope, place, optimize=True)
            normal = np.cross(along[0], along[1], axis=2)
            nodal = -self.factor * patch.pressure * np.einsum("q,qa,fqic->faic", w, shape, normal, optimize=True)
            np.add.at(total, patch.facets, nodal)
        return total.reshape(u.shape)

    def stiffness(self, u: FloatArray) -> sp.csr_matrix:
        """dP/du (n_dof, n_dof) N/m at u (n_dof,) m."""
        n_dof = len(u)
        total = sp.csr_matrix((n_dof, n_dof))
        for patch in self.patches:
            x, w = face_element(patch.facets).mass_rule()
            shape, slope = face_element(patch.facets).shape(x)
            along = np.einsum("qad,faic->dfqi", slope, self._placed(u[:, None], patch.facets), optimize=True)
            turned = np.einsum("qb,fqk->fqbk", slope[:, :, 0], along[1])
            turned -= np.einsum("qb,fqk->fqbk", slope[:, :, 1], along[0])
            blocks = np.einsum("q,qa,fqbk,ijk->faibj", w, shape, turned, _LEVI_CIVITA, optimize=True)
            dof = (3 * patch.facets[:, :, None] + np.arange(3)).reshape(len(patch.facets), -1)
            n = dof.shape[1]
            values = -self.factor * patch.pressure * blocks.reshape(len(dof), n, n)
            rows, columns = np.repeat(dof, n, axis=1).ravel(), np.tile(dof, (1, n)).ravel()
            total = total + sp.csr_matrix((values.ravel(), (rows, columns)), shape=(n_dof, n_dof))
        return total

    def _placed(self, u: FloatArray, facets: IntArray) -> FloatArray:
        """Displaced nodes of the facets, (n_facet, n_local, 3, n_case) m."""
        return np.asarray(self.points[facets][..., None] + u.reshape(-1, 3, u.shape[1])[facets])


def follower_set(loads: Sequence[Load], bodies: Sequence[Body], offsets: IntArray, points: FloatArray) -> FollowerSet:
    """The follower pressures among the loads; unknown names and numbers not finite raise ``FemInputError``."""
    patches = []
    for load in loads:
        if not isinstance(load, FollowerPressure):
            continue
        where = f"load {load.name}"
        index, surface = locate(bodies, load.surface, where=where, surface=True)
        facets = bodies[index].mesh.surface(surface) + offsets[index]
        patches.append(_Patch(facets, finite_number(load.pressure, "the load", where=where)))
    return FollowerSet(tuple(patches), points)
