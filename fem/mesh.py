"""A body: quadratic cells with named surfaces and node sets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.element import reference_element
from fem.errors import FemInputError
from fem.finite_values import as_numbers
from fem.names import nearest

SKIN = "skin"
"""Every mesh has this surface: all its outer faces."""


@dataclass(frozen=True)
class Mesh:
    """Nodes, cells, named surfaces and named node sets of one body.

    Attributes
    ----------
    points : (n_node, 3) m.
    cells : (n_cell, n_local) node numbers, VTK order.
    element : "hex20", "hex27" or "tet10".
    surfaces : name -> (n_facet, n_face_local) node numbers, outward orientation.
    node_sets : name -> (n,) node numbers; points, lines, or anything else that is no surface.

    Raises
    ------
    FemInputError : no cells, points that are not finite, or cells that name nodes that do not exist.
    """

    points: FloatArray
    cells: IntArray
    element: str
    surfaces: dict[str, IntArray]
    node_sets: dict[str, IntArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", as_numbers(self.points, "the table of points", where="mesh"))
        object.__setattr__(self, "cells", _node_numbers(self.cells, "cells"))
        for group in ("surfaces", "node_sets"):
            named = {name: _node_numbers(nodes, name) for name, nodes in getattr(self, group).items()}
            object.__setattr__(self, group, named)
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            advice = "a mesh needs (n_node, 3) coordinates"
            raise FemInputError("not a table of points", where="mesh", value=self.points.shape, advice=advice)
        n_local = len(reference_element(self.element).nodes)
        if self.cells.ndim != 2 or len(self.cells) == 0 or self.cells.shape[1] != n_local:
            advice = f"a mesh of {self.element} needs (n_cell, {n_local}) node numbers"
            raise FemInputError("not a table of cells", where="mesh", value=self.cells.shape, advice=advice)
        if self.cells.min() < 0 or self.cells.max() >= len(self.points):
            value = (int(self.cells.min()), int(self.cells.max()))
            raise FemInputError("cells name missing nodes", where=f"mesh of {len(self.points)} nodes", value=value)
        bad = np.flatnonzero(~np.isfinite(self.points).all(axis=1))
        if len(bad):
            raise FemInputError("coordinates are not finite", where=f"mesh, node {bad[0]}", value=self.points[bad[0]])

    def surface(self, name: str) -> IntArray:
        """Facets of a named surface, or of the whole "skin"; an unknown name raises ``FemInputError``."""
        if name in self.surfaces:
            return self.surfaces[name]
        if name == SKIN:
            return self.skin()
        raise FemInputError(
            "unknown surface", where="mesh", value=name, advice=nearest(name, self.surfaces, "known surfaces:")
        )

    def nodes(self, name: str, *, where: str = "mesh") -> IntArray:
        """Nodes of a node set or surface; "a&b" are the nodes that both have, such as the edge of two faces.

        An unknown name or an empty intersection raises ``FemInputError``; ``where`` says who asks.
        """
        found: IntArray | None = None
        for part in [name] if name in {*self.surfaces, *self.node_sets} else name.split("&"):
            here = self.node_sets[part] if part in self.node_sets else np.unique(self._known_surface(part))
            found = here if found is None else np.intersect1d(found, here)
        if found is None or len(found) == 0:
            raise FemInputError("no node belongs to this set", where=where, value=name)
        return np.asarray(found)

    def _known_surface(self, name: str) -> IntArray:
        if name in self.surfaces or name == SKIN:
            return self.surface(name)
        advice = nearest(name, [*self.surfaces, *self.node_sets], "known surfaces:")
        raise FemInputError("unknown surface or node set", where="mesh", value=name, advice=advice)

    def edges(self) -> IntArray:
        """All edges of all cells once, (n_edge, 3): two ends and the node between them."""
        edges = self.cells[:, reference_element(self.element).edges].reshape(-1, 3)
        return np.asarray(edges[np.unique(edges[:, 2], return_index=True)[1]])

    def facets(self) -> IntArray:
        """All faces of all cells, (n_cell * n_face, n_face_local)."""
        faces = reference_element(self.element).faces
        return self.cells[:, faces].reshape(-1, faces.shape[1])

    def skin(self) -> IntArray:
        """Faces that belong to one cell only, (n_facet, n_face_local)."""
        facets = self.facets()
        corners = 3 if self.element == "tet10" else 4
        _, inverse, counts = np.unique(
            np.sort(facets[:, :corners], axis=1), axis=0, return_inverse=True, return_counts=True
        )
        return np.asarray(facets[counts[inverse.ravel()] == 1])

    def with_region(self, name: str, where: Callable[[FloatArray], BoolArray]) -> Mesh:
        """The mesh with one more node set, and the surface of the same name if whole outer faces lie in it.

        Parameters
        ----------
        where : from points (n_node, 3) in m to (n_node,) True where the node belongs to the region.
        """
        chosen = np.asarray(where(self.points), dtype=bool)
        if not chosen.any():
            raise FemInputError("no node lies in the region", where=f"region {name}")
        skin = self.skin()
        facets = skin[chosen[skin].all(axis=1)]
        surfaces = self.surfaces | ({name: facets} if len(facets) else {})
        return replace(self, surfaces=surfaces, node_sets=self.node_sets | {name: np.flatnonzero(chosen)})


def _node_numbers(value: npt.ArrayLike, name: str) -> IntArray:
    """An array of whole numbers; anything else raises ``FemInputError``."""
    numbers = as_numbers(value, f"the table of {name}", where="mesh")
    if not np.array_equal(numbers, np.rint(numbers)):
        raise FemInputError("node numbers must be whole", where="mesh", value=name)
    return np.asarray(value, dtype=np.int64)


def within(
    x: tuple[float, float] | None = None,
    y: tuple[float, float] | None = None,
    z: tuple[float, float] | None = None,
) -> Callable[[FloatArray], BoolArray]:
    """The points between the given coordinates in m, for ``Mesh.with_region``; None leaves an axis open.

    Points count that are no farther outside than 1e-6 of the largest extent of the mesh.
    """

    def inside(points: FloatArray) -> BoolArray:
        margin = 1e-6 * float(np.ptp(points, axis=0).max())
        chosen = np.ones(len(points), dtype=bool)
        for axis, limits in enumerate((x, y, z)):
            if limits is not None:
                chosen &= (points[:, axis] >= limits[0] - margin) & (points[:, axis] <= limits[1] + margin)
        return chosen

    return inside
