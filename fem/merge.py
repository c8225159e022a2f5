"""One mesh out of several that touch: blocks with coincident nodes become one body."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fem.arrays import FloatArray, IntArray
from fem.errors import FemInputError
from fem.mesh import Mesh

_COINCIDENT = 1e-6
"""Nodes closer than this share of the largest extent are one node."""

_SIDE = re.compile(r"[xyz]_(min|max)(_\d+)*")
"""Names that blocks give their sides by themselves."""

_Parts = dict[int, IntArray]
"""Facets by the number of the mesh that they come from."""


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """The meshes as one, coincident nodes joined; grid lines must meet at the faces that touch.

    Surfaces and node sets that the user named alike are united; faces that end up inside belong to no surface any more.
    Sides of blocks (``x_min`` ... ``z_max``) have their names by themselves: they are united where they touch or lie in
    one plane. Others of one name are told apart by the number of their mesh, from 1: ``x_min_1``, ``x_min_3``.

    Raises
    ------
    FemInputError : no mesh, different elements, or nodes of one mesh that coincide.
    """
    elements = sorted({mesh.element for mesh in meshes})
    if len(elements) != 1:
        advice = "merge meshes of one element; a tie joins others"
        raise FemInputError("meshes of different elements", where="merge", value=", ".join(elements), advice=advice)
    points = np.vstack([mesh.points for mesh in meshes])
    reach = _COINCIDENT * float(np.ptp(points, axis=0).max())
    kept, number = _joined(meshes, points, reach)
    offsets = np.concatenate([[0], np.cumsum([len(mesh.points) for mesh in meshes])[:-1]])
    cells = np.vstack([number[mesh.cells + offset] for mesh, offset in zip(meshes, offsets, strict=True)])
    whole = Mesh(points[kept], cells, elements[0], {})
    outer = {tuple(row) for row in np.sort(whole.skin(), axis=1).tolist()}
    surfaces: dict[str, IntArray] = {}
    node_sets: dict[str, IntArray] = {}
    for name in dict.fromkeys(name for mesh in meshes for name in mesh.surfaces):
        parts = {}
        for n, (mesh, offset) in enumerate(zip(meshes, offsets, strict=True)):
            facets = number[mesh.surfaces.get(name, mesh.cells[:0, :0]) + offset]
            facets = facets[[tuple(row) in outer for row in np.sort(facets, axis=1).tolist()]]
            if len(facets):
                parts[n] = facets
        surfaces |= dict(_named(name, parts, whole.points, reach))
    for name in dict.fromkeys(name for mesh in meshes for name in mesh.node_sets):
        sets = [number[m.node_sets[name] + o] for m, o in zip(meshes, offsets, strict=True) if name in m.node_sets]
        node_sets[name] = np.unique(np.concatenate(sets))
    return Mesh(whole.points, whole.cells, whole.element, surfaces, node_sets)


def _joined(meshes: Sequence[Mesh], points: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Numbers of the nodes that stay, and the new number of every node."""
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.points) for mesh in meshes])
    if np.any(owner[pairs[:, 0]] == owner[pairs[:, 1]]):
        raise FemInputError("nodes of one mesh coincide", where="merge", value=f"closer than {reach:.2e} m")
    target = np.arange(len(points))
    # Pairs are ordered (low, high): the lowest of all coincident nodes stays.
    np.minimum.at(target, pairs[:, 1], pairs[:, 0])
    kept, number = np.unique(target, return_inverse=True)
    return kept, number


def _named(name: str, parts: _Parts, points: FloatArray, reach: float) -> Iterator[tuple[str, IntArray]]:
    """The surfaces that the parts of one name make up."""
    groups = _groups(parts, points, reach) if _SIDE.fullmatch(name) else [list(parts)]
    for group in groups:
        if group:
            facets = np.vstack([parts[n] for n in group])
            yield (name if len(groups) == 1 else f"{name}_{group[0] + 1}"), facets


def _groups(parts: _Parts, points: FloatArray, reach: float) -> list[list[int]]:
    """Numbers of the meshes whose parts touch or lie in one plane, directly or by way of others."""
    order = list(parts)
    linked = np.eye(len(order), dtype=bool)
    for i, first in enumerate(order):
        for j, second in enumerate(order[:i]):
            shared = np.intersect1d(parts[first], parts[second])
            linked[i, j] = len(shared) > 0 or _in_one_plane(points[np.union1d(parts[first], parts[second])], reach)
    _, label = sp.csgraph.connected_components(sp.csr_matrix(linked), directed=False)
    return [[order[i] for i in np.flatnonzero(label == group)] for group in range(label.max(initial=-1) + 1)]


def _in_one_plane(points: FloatArray, reach: float) -> bool:
    """Whether the smallest extent of the points (n, 3), by principal axes, is within ``reach`` m."""
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return float(np.ptp(centred @ axes[:, 0])) <= 2.0 * reach
