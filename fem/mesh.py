"""A body: quadratic cells with named surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray, IntArray
from fem.element import reference_element
from fem.errors import FemInputError


@dataclass(frozen=True)
class Mesh:
    """Nodes, cells and named surfaces of one body.

    Attributes
    ----------
    points : (n_node, 3) m.
    cells : (n_cell, n_local) node numbers, VTK order.
    element : "hex20", "hex27" or "tet10".
    surfaces : name -> (n_facet, n_face_local) node numbers, outward orientation.
    """

    points: FloatArray
    cells: IntArray
    element: str
    surfaces: dict[str, IntArray]

    def surface(self, name: str) -> IntArray:
        """Facets of a named surface; an unknown name raises ``FemInputError``."""
        if name not in self.surfaces:
            known = ", ".join(sorted(self.surfaces))
            raise FemInputError("unknown surface", where="mesh", value=name, advice=f"known surfaces: {known}")
        return self.surfaces[name]

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
