"""Bonded surfaces of non-matching meshes: patch test, error of the penalty, modes, errors."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.loads import Traction
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Model, Support, Tie, build_model
from fem.modes import solve_modes
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import STEEL, box

SETTINGS = StaticSettings(steps=1, solver="superlu")


def _pair(element: str, cells: tuple[int, int]) -> tuple[Mesh, Mesh]:
    n, m = cells
    return box((1.0, 1.0, 1.0), (m, 1, m), element), box((1.0, 1.0, 1.0), (n, 1, n), element, shift=1.0)


def _pulled(element: str, cells: tuple[int, int], traction: tuple[float, float, float]) -> Model:
    material = Material(2e6, 0.0, 1000.0)
    lower, upper = _pair(element, cells)
    sides = [] if traction[0] else [Support(f"{b}.{a}_min", (a,)) for b in ("lower", "upper") for a in "xz"]
    ends = [Support("lower.y_min", ("x", "y", "z") if traction[0] else ("y",)), *sides]
    if traction[0]:
        # Simple shear: no normal motion anywhere.
        ends += [Support(f"{b}.skin", ("y", "z")) for b in ("lower", "upper")]
    return build_model(
        [Body("lower", lower, material, "linear"), Body("upper", upper, material, "linear")],
        ties=[Tie("bond", "upper.y_min", "lower.y_max")],
        supports=ends,
        loads=[Traction("pull", "upper.y_max", traction)],
    )


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
@pytest.mark.parametrize("cells", [(2, 2), (2, 3), (3, 1)])
def test_tied_patch_passes_in_tension(element: str, cells: tuple[int, int]) -> None:
    """Uniform tension through non-matching meshes: each half stretches by sigma/E, the bond by sigma/k; 1e-9."""
    model = _pulled(element, cells, (0.0, 1e4, 0.0))
    u = solve_static(model, model.load, SETTINGS).u.reshape(-1, 3)[:, 1]
    strain, jump = 1e4 / 2e6, 1e4 / model.bonds.law[0, 0]
    below = model.points[:, 1] * strain
    upper = np.arange(len(u)) >= model.offsets[1]
    np.testing.assert_allclose(u, below + jump * upper, atol=1e-9 * strain)
    assert jump < 0.0101 * strain


@pytest.mark.parametrize("cells", [(2, 3), (3, 2)])
def test_tied_patch_passes_in_shear(cells: tuple[int, int]) -> None:
    """Uniform shear stress: gamma = tau/G in both halves, jump tau/k; 1e-9."""
    model = _pulled("hex20", cells, (1e4, 0.0, 0.0))
    u = solve_static(model, model.load, SETTINGS).u.reshape(-1, 3)[:, 0]
    angle, jump = 1e4 / 1e6, 1e4 / model.bonds.law[0, 1]
    upper = np.arange(len(u)) >= model.offsets[1]
    np.testing.assert_allclose(u, model.points[:, 1] * angle + jump * upper, atol=1e-9 * angle)


def _beam(stiffness: float | None) -> Model:
    """A cantilever of 0.2 x 0.02 x 0.02 m, whole or tied in the middle with other cells on the free half."""
    root = [Support("root.x_min", ("x", "y", "z"))]
    if stiffness is None:
        return build_model([Body("root", box((0.2, 0.02, 0.02), (8, 2, 2)), STEEL, "linear")], supports=root)
    free = box((0.1, 0.02, 0.02), (4, 3, 3))
    free = Mesh(free.points + np.array([0.1, 0.0, 0.0]), free.cells, free.element, free.surfaces)
    bodies = [
        Body("root", box((0.1, 0.02, 0.02), (4, 2, 2)), STEEL, "linear"),
        Body("free", free, STEEL, "green_lagrange"),
    ]
    return build_model(bodies, supports=root, ties=[Tie("bond", "free.x_min", "root.x_max", stiffness=stiffness)])


def _frequencies(model: Model) -> np.ndarray:
    rest = solve_static(model, np.zeros(model.n_dof), SETTINGS)
    return np.sort(solve_modes(model, rest, 5, solver="superlu").omega)


def test_modes_of_a_tied_beam_are_those_of_the_whole_one() -> None:
    """The bond is h/100 of material at mid-span: compliance 0.02/3/100 of 0.2 m, 3e-4; plus other cells, below 1e-3.

    A bond 100 times softer must be seen, and lower every frequency.
    """
    whole = _frequencies(_beam(None))
    tied = _frequencies(_beam(100.0))
    np.testing.assert_allclose(tied, whole, rtol=1e-3)
    assert np.all(_frequencies(_beam(1.0)) < tied)


def test_tangent_of_a_tie_is_its_force() -> None:
    """K u = f of a linear bond to roundoff, and rigid motion of both bodies costs nothing."""
    model = _pulled("hex20", (2, 3), (0.0, 1e4, 0.0))
    rng = np.random.default_rng(3)
    u = rng.standard_normal((model.n_dof, 2))
    force, energy = model.elastic_force(u)
    np.testing.assert_allclose(force, model.elastic_tangent(u[:, 0]) @ u, atol=1e-9 * np.abs(force).max())
    np.testing.assert_allclose(energy, 0.5 * (u * force).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(model.elastic_force(np.ones((model.n_dof, 1)))[0], 0.0, atol=1e-6)


def test_tie_holds_a_body_in_the_restraint_check() -> None:
    lower, upper = _pair("hex20", (1, 2))
    bodies = [Body("lower", lower, STEEL), Body("upper", upper, STEEL)]
    held = [Support("lower.y_min", ("x", "y", "z"))]
    loose = build_model(bodies, supports=held)
    with pytest.raises(FemInputError, match=r"upper: nothing holds"):
        solve_static(loose, loose.load, SETTINGS)
    tied = build_model(bodies, supports=held, ties=[Tie("bond", "upper.y_min", "lower.y_max")])
    assert not solve_static(tied, tied.load, SETTINGS).u.any()


def test_bad_ties_say_why() -> None:
    lower, upper = _pair("hex20", (1, 2))
    bodies = [Body("lower", lower, STEEL), Body("upper", upper, STEEL)]
    with pytest.raises(FemInputError, match="bond"):
        build_model(bodies, ties=[Tie("bond", "upper.y_max", "lower.y_max")])
    with pytest.raises(FemInputError, match="stiffness must be positive"):
        build_model(bodies, ties=[Tie("bond", "upper.y_min", "lower.y_max", stiffness=0.0)])
    with pytest.raises(FemInputError, match="unknown surface"):
        build_model(bodies, ties=[Tie("bond", "upper.nothing", "lower.y_max")])
