"""Loads: pressures, tractions, forces on surfaces, lines and points, and gravity; all but one are dead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.body import Body, locate
from fem.errors import FemInputError
from fem.finite_values import finite_number, finite_vector
from fem.locate_point import cell_of_point
from fem.names import nearest
from fem.pairing import surface_points

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Clamp:
    """A dead pressure on a surface that sums to ``total_force`` N against its outward normals."""

    name: str
    surface: str
    total_force: float


@dataclass(frozen=True)
class Pressure:
    """A dead pressure in Pa against the outward normals of the undeformed surface."""

    name: str
    surface: str
    pressure: float


@dataclass(frozen=True)
class FollowerPressure:
    """A pressure in Pa against the outward normals of the surface as it deforms: it turns and stretches with it."""

    name: str
    surface: str
    pressure: float


@dataclass(frozen=True)
class Traction:
    """A dead load of equal density: ``density`` in N/m^2 on a surface, N/m on a line of nodes.

    ``region`` is "<body>.<surface>" or names nodes as ``Support`` does; a line is made of whole edges of cells.
    """

    name: str
    region: str
    density: Vector


@dataclass(frozen=True)
class Force:
    """A dead force in N, spread evenly over a surface or line, or in equal parts over nodes that are neither."""

    name: str
    region: str
    total: Vector


@dataclass(frozen=True)
class PointForce:
    """A dead force in N at a material point of the undeformed structure, m, which need not be a node.

    ``body`` says which one it pulls at where bodies touch in the point.
    """

    name: str
    point: Vector
    force: Vector
    body: str | None = None


@dataclass(frozen=True)
class Gravity:
    """Body force rho a with the acceleration a in m/s^2 on all bodies, or on those named."""

    name: str
    acceleration: Vector
    bodies: tuple[str, ...] = ()


DeadLoad = Clamp | Pressure | Traction | Force | PointForce | Gravity
Load = DeadLoad | FollowerPressure


@dataclass(frozen=True)
class Assembly:
    """What loads act on: bodies, first node of each, (n_node, 3) points in m and the (n_dof, n_dof) mass in kg."""

    bodies: tuple[Body, ...]
    offsets: IntArray
    points: FloatArray
    mass: sp.csr_matrix


def load_vector(load: Load, assembly: Assembly) -> FloatArray:
    """Consistent nodal forces of a load at load factor 1, (n_dof,) N.

    Raises
    ------
    FemInputError : unknown names, a point outside all bodies or on several, numbers that are not finite, a follower
        pressure.
    """
    if isinstance(load, FollowerPressure):
        advice = "give it to build_model, or use Pressure"
        raise FemInputError("a pressure that follows has no dead force", where=f"load {load.name}", advice=advice)
    nodal = _nodal(load, assembly)
    if not np.isfinite(nodal).all():
        raise FemInputError("the load is not finite", where=f"load {load.name}", advice="check its numbers")
    return np.asarray(nodal).ravel()


def _nodal(load: DeadLoad, assembly: Assembly) -> FloatArray:
    where = f"load {load.name}"
    if isinstance(load, Clamp | Pressure):
        return _pressure(load, assembly)
    if isinstance(load, Gravity):
        return _gravity(load, assembly)
    if isinstance(load, PointForce):
        found = cell_of_point(assembly.bodies, assembly.offsets, load.point, where=where, body=load.body)
        nodal = np.zeros((len(assembly.points), 3))
        nodal[found.nodes] = np.outer(found.shape, finite_vector(load.force, "the load", where=where))
        return nodal
    share = nodal_share(assembly, load.region, where=where)
    if isinstance(load, Force):
        return np.outer(share / share.sum(), finite_vector(load.total, "the load", where=where))
    if not _extended(assembly, load.region, where):
        advice = "use Force for single points"
        raise FemInputError("neither a surface nor a line", where=where, value=load.region, advice=advice)
    return np.outer(share, finite_vector(load.density, "the load", where=where))


def _pressure(load: Clamp | Pressure, assembly: Assembly) -> FloatArray:
    index, surface = locate(assembly.bodies, load.surface, where=f"load {load.name}", surface=True)
    facets = assembly.bodies[index].mesh.surface(surface) + assembly.offsets[index]
    at = surface_points(assembly.points, facets)
    given = load.pressure if isinstance(load, Pressure) else load.total_force
    given = finite_number(given, "the load", where=f"load {load.name}")
    pressure = given if isinstance(load, Pressure) else given / at.area.sum()
    density = -pressure * at.area[:, None] * at.normals
    nodal = np.zeros((len(assembly.points), 3))
    np.add.at(nodal, at.nodes, at.shape[:, :, None] * density[:, None, :])
    return nodal


def _gravity(load: Gravity, assembly: Assembly) -> FloatArray:
    names = [body.name for body in assembly.bodies]
    acceleration = finite_vector(load.acceleration, "the acceleration", where=f"load {load.name}")
    for name in load.bodies:
        if name not in names:
            advice = nearest(name, names, "bodies are")
            raise FemInputError("unknown body", where=f"load {load.name}", value=name, advice=advice)
    force = (assembly.mass @ np.tile(acceleration, len(assembly.points))).reshape(-1, 3)
    for body, offset in zip(assembly.bodies, assembly.offsets, strict=True):
        if load.bodies and body.name not in load.bodies:
            force[int(offset) : int(offset) + len(body.mesh.points)] = 0.0
    return np.asarray(force)


def nodal_share(assembly: Assembly, name: str, *, where: str) -> FloatArray:
    """int N dA on a surface (m^2), int N ds on a line (m), or 1 at each other node: (n_node,)."""
    index, region = locate(assembly.bodies, name, where=where)
    mesh, offset = assembly.bodies[index].mesh, assembly.offsets[index]
    share = np.zeros(len(assembly.points))
    if region in mesh.surfaces or region == "skin":
        at = surface_points(assembly.points, mesh.surface(region) + offset)
        np.add.at(share, at.nodes, at.shape * at.area[:, None])
        return share
    nodes = mesh.nodes(region, where=where)
    edges = _line(assembly, name, where)
    if len(edges) == 0:
        share[nodes + offset] = 1.0
        return share
    # Gauss points of the 3-node edge on [-1, 1]; order: two ends, middle.
    x, w = np.polynomial.legendre.leggauss(3)
    shape = np.column_stack([0.5 * x * (x - 1.0), 0.5 * x * (x + 1.0), 1.0 - x * x])
    slope = np.column_stack([x - 0.5, x + 0.5, -2.0 * x])
    length = np.linalg.norm(np.einsum("qa,eai->eqi", slope, mesh.points[edges]), axis=2)
    np.add.at(share, edges + offset, np.einsum("q,eq,qa->ea", w, length, shape))
    return share


def _line(assembly: Assembly, name: str, where: str) -> IntArray:
    """Edges (n_edge, 3) of cells whose nodes all belong to the set; empty if they do not cover it."""
    index, region = locate(assembly.bodies, name, where=where)
    mesh = assembly.bodies[index].mesh
    nodes, edges = mesh.nodes(region), mesh.edges()
    edges = edges[np.isin(edges, nodes).all(axis=1)]
    covered = len(np.unique(edges)) == len(nodes)
    # More edges than a chain of its nodes has: a patch or a volume, over which a line load means nothing.
    return edges if covered and 2 * len(edges) <= len(nodes) else edges[:0]


def _extended(assembly: Assembly, name: str, where: str) -> bool:
    index, region = locate(assembly.bodies, name, where=where)
    return region in assembly.bodies[index].mesh.surfaces or region == "skin" or len(_line(assembly, name, where)) > 0
