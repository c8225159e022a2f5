"""One mesh out of several that touch: blocks with coincident nodes become one body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from fem.errors import FemInputError
from fem.mesh import Mesh

_COINCIDENT = 1e-6
"""Nodes closer than this share of the largest extent are one node."""


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """The meshes as one, coincident nodes joined; grid lines must meet at the faces that touch.

    Surfaces and node sets of the same name are united; faces that end up inside belong to no surface any more.

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
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.points) for mesh in meshes])
    if np.any(owner[pairs[:, 0]] == owner[pairs[:, 1]]):
        raise FemInputError("nodes of one mesh coincide", where="merge", value=f"closer than {reach:.2e} m")
    target = np.arange(len(points))
    # Pairs are ordered (low, high): the lowest of all coincident nodes stays.
    np.minimum.at(target, pairs[:, 1], pairs[:, 0])
    kept, number = np.unique(target, return_inverse=True)
    offsets = np.concatenate([[0], np.cumsum([len(mesh.points) for mesh in meshes])[:-1]])
    cells = np.vstack([number[mesh.cells + offset] for mesh, offset in zip(meshes, offsets, strict=True)])
    whole = Mesh(points[kept], cells, elements[0], {})
    outer = {tuple(row) for row in np.sort(whole.skin(), axis=1).tolist()}
    surfaces, node_sets = {}, {}
    for name in dict.fromkeys(name for mesh in meshes for name in mesh.surfaces):
        facets = np.vstack(
            [number[m.surfaces[name] + o] for m, o in zip(meshes, offsets, strict=True) if name in m.surfaces]
        )
        facets = facets[[tuple(row) in outer for row in np.sort(facets, axis=1).tolist()]]
        if len(facets):
            surfaces[name] = facets
    for name in dict.fromkeys(name for mesh in meshes for name in mesh.node_sets):
        parts = [number[m.node_sets[name] + o] for m, o in zip(meshes, offsets, strict=True) if name in m.node_sets]
        node_sets[name] = np.unique(np.concatenate(parts))
    return Mesh(whole.points, whole.cells, whole.element, surfaces, node_sets)
