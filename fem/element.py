"""Quadratic reference elements in VTK node order, their faces and integration rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

from fem.arrays import FloatArray, IntArray
from fem.errors import FemInputError

_HEX_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_HEX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_HEX_FACES = [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)]
_TET_CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_TET_FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
_QUAD_CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]
_TRI_CORNERS = [(0, 0), (1, 0), (0, 1)]


@dataclass(frozen=True)
class ReferenceElement:
    """An isoparametric reference element.

    Attributes
    ----------
    name : "hex20", "hex27", "tet10", "quad8", "quad9" or "tri6".
    nodes : (n_local, dim) reference coordinates in [0, 1], VTK order.
    faces : (n_face, n_face_local) local nodes of each face, outward orientation; empty for surfaces.
    face_name : element of the faces, "" for surfaces.
    edges : (n_edge, 3) local nodes of each edge: two ends and the node between them.
    """

    name: str
    nodes: FloatArray
    faces: IntArray
    face_name: str
    edges: IntArray

    def shape(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Shape functions and gradients at reference points.

        Parameters
        ----------
        x : (n_point, dim) reference coordinates.

        Returns
        -------
        N : (n_point, n_local), dN : (n_point, n_local, dim) with respect to reference coordinates.
        """
        basis, permutation = _basis(self.name)
        values = [basis.lbasis(np.ascontiguousarray(x.T), int(i)) for i in permutation]
        n = np.stack([np.broadcast_to(v[0], x.shape[:1]) for v in values], axis=1)
        dn = np.stack([np.broadcast_to(v[1], x.T.shape).T for v in values], axis=1)
        return np.ascontiguousarray(n), np.ascontiguousarray(dn)

    def stiffness_rule(self) -> tuple[FloatArray, FloatArray]:
        """Points (n_point, dim) and weights (n_point,) for internal force and tangent.

        TET10: 4 points (degree 2, exact for straight sides). HEX20: the 14-point rule of degree 5 of Irons (1971),
        which keeps full rank. HEX27: 27 points.
        """
        if self.name == "hex20":
            return _irons_14()
        return self._gauss(2 if self.name == "tet10" else 5)

    def mass_rule(self) -> tuple[FloatArray, FloatArray]:
        """Points and weights for the consistent mass and for loads: exact on straight-sided cells."""
        return self._gauss(4 if self.name in {"tet10", "tri6"} else 5)

    def _gauss(self, order: int) -> tuple[FloatArray, FloatArray]:
        return gauss_rule(self.name, order)


@cache
def gauss_rule(name: str, degree: int) -> tuple[FloatArray, FloatArray]:
    """Points (n_point, dim) and weights of the rule that is exact to ``degree`` on the reference cell of an element."""
    x, w = get_quadrature(_basis(name)[0].refdom, degree)
    return np.ascontiguousarray(x.T), np.ascontiguousarray(w)


def _irons_14() -> tuple[FloatArray, FloatArray]:
    """Irons, Quadrature rules for brick based finite elements, IJNME 3 (1971) 293-294, mapped to [0, 1]^3."""
    a, b = np.sqrt(19.0 / 30.0), np.sqrt(19.0 / 33.0)
    axis = np.vstack([a * np.eye(3), -a * np.eye(3)])
    corner = b * (2.0 * np.array(_HEX_CORNERS, dtype=float) - 1.0)
    weights = np.concatenate([np.full(6, 320.0 / 361.0), np.full(8, 121.0 / 361.0)]) / 8.0
    return 0.5 * (1.0 + np.vstack([axis, corner])), weights


@cache
def _basis(name: str) -> tuple[skfem.Element, IntArray]:
    """The scikit-fem element and, per VTK node, its local number there."""
    basis = {
        "hex20": skfem.ElementHexS2,
        "hex27": skfem.ElementHex2,
        "tet10": skfem.ElementTetP2,
        "quad8": skfem.ElementQuadS2,
        "quad9": skfem.ElementQuad2,
        "tri6": skfem.ElementTriP2,
    }[name]()
    distance = np.abs(_nodes(name)[:, None, :] - np.asarray(basis.doflocs)[None, :, :]).max(axis=2)
    permutation = distance.argmin(axis=1)
    if distance.min(axis=1).max() > 1e-12:
        raise FemInputError("node table disagrees with scikit-fem", where=f"element {name}")
    return basis, permutation.astype(np.int64)


def _with_midpoints(corners: Sequence[tuple[int, ...]], edges: Sequence[tuple[int, int]]) -> FloatArray:
    c = np.array(corners, dtype=float)
    return np.vstack([c, [0.5 * (c[a] + c[b]) for a, b in edges]])


@cache
def _nodes(name: str) -> FloatArray:
    ring = [(0, 1), (1, 2), (2, 3), (3, 0)]
    if name == "tet10":
        return _with_midpoints(_TET_CORNERS, _TET_EDGES)
    if name == "tri6":
        return _with_midpoints(_TRI_CORNERS, [(0, 1), (1, 2), (2, 0)])
    if name == "quad8":
        return _with_midpoints(_QUAD_CORNERS, ring)
    if name == "quad9":
        return np.vstack([_nodes("quad8"), [[0.5, 0.5]]])
    if name == "hex20":
        return _with_midpoints(_HEX_CORNERS, _HEX_EDGES)
    corner = np.array(_HEX_CORNERS, dtype=float)
    centres = [corner[list(face)].mean(axis=0) for face in _HEX_FACES]
    return np.vstack([_nodes("hex20"), centres, [[0.5, 0.5, 0.5]]])


def _face_table(name: str) -> IntArray:
    """Local nodes of every face in the VTK order of the face element."""
    nodes = _nodes(name)
    rows = []
    for face in _TET_FACES if name == "tet10" else _HEX_FACES:
        corner = nodes[list(face)]
        wanted = [*corner, *(0.5 * (corner + np.roll(corner, -1, axis=0)))]
        if name == "hex27":
            wanted.append(corner.mean(axis=0))
        rows.append([int(np.abs(nodes - p).max(axis=1).argmin()) for p in wanted])
    return np.array(rows, dtype=np.int64)


@cache
def reference_element(name: str) -> ReferenceElement:
    """The reference element of that name; unknown names raise ``FemInputError``."""
    face_of = {"hex20": "quad8", "hex27": "quad9", "tet10": "tri6", "quad8": "", "quad9": "", "tri6": ""}
    if name not in face_of:
        raise FemInputError(
            "unknown element", where="element", value=name, advice=f"choose one of {', '.join(face_of)}"
        )
    solid = bool(face_of[name])
    faces = _face_table(name) if solid else np.empty((0, 0), dtype=np.int64)
    return ReferenceElement(name, _nodes(name), faces, face_of[name], _edge_table(name))


def _edge_table(name: str) -> IntArray:
    """Middle nodes follow the corners in the order of the edges."""
    ring = [(0, 1), (1, 2), (2, 3), (3, 0)]
    ends = {"tet10": _TET_EDGES, "tri6": [(0, 1), (1, 2), (2, 0)], "hex20": _HEX_EDGES, "hex27": _HEX_EDGES}
    pairs = ends.get(name, ring)
    n_corner = {"tet10": 4, "tri6": 3, "hex20": 8, "hex27": 8}.get(name, 4)
    return np.array([(a, b, n_corner + k) for k, (a, b) in enumerate(pairs)], dtype=np.int64)
