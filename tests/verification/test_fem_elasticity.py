"""Statics of solids: V01 patch test, V02 rigid rotation, V04 uniaxial stretch, V05 elastica."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from scipy.spatial.transform import Rotation

from fem.element import reference_element
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Model, Support
from fem.pairing import surface_points
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import box, distorted, single, trilinear

_HEX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_INNER = (
    (0.249, 0.342, 0.192),
    (0.826, 0.288, 0.288),
    (0.850, 0.649, 0.263),
    (0.273, 0.750, 0.230),
    (0.320, 0.186, 0.643),
    (0.677, 0.305, 0.683),
    (0.788, 0.693, 0.644),
    (0.165, 0.745, 0.702),
)


def _seven_hexes(element: str) -> Mesh:
    """A unit cube of one distorted inner and six outer hexahedra, after MacNeal & Harder (1985)."""
    reference = reference_element(element)
    corner = np.vstack([reference.nodes[:8], _INNER])
    cells = [list(range(8, 16)), *([c + 8 for c in face] + list(face) for face in _HEX_FACES)]
    places = np.einsum("ac,eci->eai", trilinear(reference.nodes), corner[np.array(cells)])
    _, first, number = np.unique(places.reshape(-1, 3).round(9), axis=0, return_index=True, return_inverse=True)
    return Mesh(places.reshape(-1, 3)[first], number.reshape(7, -1), element, {})


def _patch(element: str) -> Mesh:
    return distorted(box((1.0, 1.0, 1.0), (2, 2, 2), element), 0.1) if element == "tet10" else _seven_hexes(element)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_v01_patch_test_gives_constant_stress(element: str) -> None:
    """V01: u = 1/2 10^-3 (2x + y + z, x + 2y + z, x + y + 2z) on the skin; sigma 2000 and tau 400 Pa inside, rel. 1e-9.

    MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20; E = 1e6 Pa, nu = 1/4. The tolerance is that of the
    manual; roundoff is 1e-13.
    """
    mesh = _patch(element)
    model = single(mesh, Material(1e6, 0.25, 1.0))
    G = 0.5e-3 * np.array([[2.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]])
    exact = (mesh.points @ G).ravel()
    inside = np.ones(len(mesh.points), dtype=bool)
    inside[np.unique(mesh.skin())] = False
    free = np.repeat(inside, 3)
    assert free.any()
    K = model.elastic_tangent(np.zeros(model.n_dof))
    u = np.where(free, 0.0, exact)
    u[free] = spla.spsolve(K[free][:, free].tocsc(), -(K @ u)[free])
    np.testing.assert_allclose(u, exact, atol=1e-9 * np.abs(exact).max())
    cells = model.nonlinear[0]
    gradient = np.einsum("eai,eqja->eqij", u.reshape(-1, 3)[cells.nodes], cells.gradients)
    strain = 0.5 * (gradient + np.swapaxes(gradient, 2, 3))
    lam, mu = cells.lame[0]
    stress = lam * np.trace(strain, axis1=2, axis2=3)[..., None, None] * np.eye(3) + 2.0 * mu * strain
    expected = np.full((3, 3), 400.0) + 1600.0 * np.eye(3)
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), rtol=1e-9)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
@pytest.mark.parametrize("degrees", [30.0, 90.0])
def test_v02_rigid_rotation_costs_nothing(element: str, degrees: float) -> None:
    """V02: internal force and energy of a rotated and shifted mesh vanish; 1e-11 E V as in the manual (roundoff)."""
    mesh = _patch(element)
    model = single(mesh, Material(1e6, 0.25, 1.0))
    turn = Rotation.from_rotvec(np.deg2rad(degrees) * np.array([1.0, 2.0, 2.0]) / 3.0).as_matrix()
    u = (mesh.points @ (turn - np.eye(3)).T + [0.3, -0.2, 0.1]).ravel()
    force, energy = model.elastic_force(u[:, None])
    assert np.abs(force).max() < 1e-11 * 1e6
    assert 0.0 <= energy[0] < 1e-11 * 1e6


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_v04_uniaxial_stretch(element: str) -> None:
    """V04: St. Venant-Kirchhoff at stretch 1.1, nu = 0: P/E = lambda (lambda^2 - 1)/2 = 0.1155; 1e-12 (roundoff)."""
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), element)
    model = single(mesh, Material(1e6, 0.0, 1.0))
    u = np.outer(mesh.points[:, 0], [0.1, 0.0, 0.0]).reshape(-1, 1)
    force, energy = model.elastic_force(u)
    end = np.unique(mesh.surface("x_max"))
    assert force.reshape(-1, 3)[end].sum(axis=0) / 1e6 == pytest.approx([0.1155, 0.0, 0.0], abs=1e-12)
    assert energy[0] / 1e6 == pytest.approx(0.5 * 0.105**2, abs=1e-13)


def _tip_load(model: Model, size: float) -> np.ndarray:
    """A transverse dead load spread evenly over the end face."""
    at = surface_points(model.points, model.facets("body.x_max"))
    load = np.zeros((len(model.points), 3))
    np.add.at(load[:, 1], at.nodes, at.shape * (size / at.area.sum() * at.area)[:, None])
    return load.ravel()


@pytest.mark.parametrize(
    ("load", "down", "back", "steps"),
    [(1.0, 0.301721, 0.056433, 4), (4.0, 0.669964, 0.328941, 20)],
    ids=["PL2/EI=1", "PL2/EI=4"],
)
def test_v05_elastica(load: float, down: float, back: float, steps: int) -> None:
    """V05: tip-loaded cantilever of L/h = 100 against the inextensible elastica (Mattiasson 1981), 0.5 % of L.

    The tolerance of the manual; cells four times as long as high are still a little stiff in bending.
    """
    L, h, E = 10.0, 0.1, 1.2e6
    model = single(
        box((L, h, h), (24, 1, 1)), Material(E, 0.0, 1.0), supports=(Support("body.x_min", ("x", "y", "z")),)
    )
    size = load * E * h**4 / 12.0 / L**2
    settings = StaticSettings(steps=steps, tolerance=1e-6, max_iterations=60, solver="superlu")
    state = solve_static(model, _tip_load(model, size), settings)
    tip = state.u.reshape(-1, 3)[np.unique(model.facets("body.x_max"))].mean(axis=0) / L
    assert tip[1] == pytest.approx(down, abs=0.005 * down)
    assert -tip[0] == pytest.approx(back, abs=0.005 * back)
