"""Stability of equilibria, and what open contact and slack bolts say."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

import fem
from fem.stability import _by_superlu, negative_pivots
from tests.fem.small_models import STEEL, blocks, box

SETTINGS = fem.StaticSettings(steps=2, solver="superlu")


def _column() -> tuple[fem.Model, float]:
    """A clamped column of 200 x 10 x 5 mm pressed along x, and its Euler load pi^2 E I / (4 L^2) in N."""
    body = fem.Body("column", box((0.2, 0.01, 0.005), (8, 1, 1)), STEEL)
    model = fem.build_model(
        [body],
        supports=[fem.Support("column.x_min", ("x", "y", "z"))],
        loads=[fem.Force("push", "column.x_max", (-1.0, 0.0, 0.0))],
    )
    return model, np.pi**2 * STEEL.young_modulus * 0.01 * 0.005**3 / 12.0 / (4.0 * 0.2**2)


@pytest.mark.parametrize(("share", "count"), [(0.9, 0), (1.1, 1), (4.5, 2), (9.5, 3)])
def test_straight_columns_lose_stability_at_the_euler_loads(share: float, count: int) -> None:
    """Loads 1 and 9 about the weak axis, 4 about the strong one (twice as wide), each within 5 % of its neighbours."""
    model, euler = _column()
    state = fem.solve_static(model, share * euler * model.load, SETTINGS)
    assert fem.unstable_directions(model, state) == count


def test_modes_of_an_unstable_state_say_so() -> None:
    model, euler = _column()
    state = fem.solve_static(model, 1.1 * euler * model.load, SETTINGS)
    for solver in ("superlu", "auto"):
        with pytest.raises(fem.FemConvergenceError, match=r"not positive definite.*unstable"):
            fem.solve_modes(model, state, 2, solver=solver)


def test_pivots_count_negative_eigenvalues() -> None:
    """Random sparse symmetric matrices, against their eigenvalues."""
    rng = np.random.default_rng(3)
    for n in (5, 30, 80):
        dense = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.3)
        dense = dense + dense.T + 3.0 * np.diag(rng.normal(size=n))
        negative = int((np.linalg.eigvalsh(dense) < 0.0).sum())
        assert negative_pivots(sp.csr_matrix(dense)) == negative
        assert _by_superlu(sp.csr_matrix(dense)) == negative
    with pytest.raises(fem.FemConvergenceError, match=r"singular|zero"):
        _by_superlu(sp.csr_matrix(np.array([[1.0, 1.0], [1.0, 1.0]])))


def _stacked() -> fem.Model:
    """Two blocks that just touch, the upper one held by contact alone."""
    model = blocks()
    return fem.build_model(
        model.bodies,
        pairs=model.pairs,
        supports=[fem.Support("lower.y_min", ("x", "y", "z"))],
        loads=[fem.Pressure("weight", "upper.y_max", 1e3)],
    )


@pytest.mark.parametrize("ask", ["modes", "stability", "path"])
def test_open_contact_that_leaves_a_part_loose_is_named(ask: str) -> None:
    model = _stacked()
    rest = fem.rest_state(model)
    calls = {
        "modes": lambda: fem.solve_modes(model, rest, 3),
        "stability": lambda: fem.unstable_directions(model, rest),
        "path": lambda: fem.follow_path(model, model.load),
    }
    message = rf"{ask}: open contact leaves a part loose.*upper free to .*contact joint open; give a state"
    with pytest.raises(fem.FemInputError, match=message):
        calls[ask]()


def test_path_goes_on_from_what_the_start_carries() -> None:
    """Pressed blocks, then pushed: the press stays while the push grows, as in a static solution that goes on."""
    model = _stacked()
    pressed = fem.solve_static(model, model.load, SETTINGS)
    push = fem.time_load(model, fem.Force("push", "upper.y_max", (100.0, 0.0, 0.0)), lambda t: t).pattern
    path = fem.follow_path(model, push, fem.PathSettings(step=0.5, largest_step=0.5), start=pressed)
    other = fem.solve_static(model, model.load + push, SETTINGS, start=pressed)
    np.testing.assert_allclose(path.displacements[-1], other.u, atol=1e-6 * np.abs(other.u).max())


def test_parts_of_one_body_that_do_not_hang_together_are_named() -> None:
    """Two cubes in one mesh, the second not held: once a singular matrix."""
    first, second = box((0.1, 0.1, 0.1), (1, 1, 1)), box((0.1, 0.1, 0.1), (1, 1, 1), shift=0.5)
    body = fem.Body("pair", fem.merged([first, second]), STEEL)
    model = fem.build_model([body], supports=[fem.Support("pair.y_min_1", ("x", "y", "z"))])
    message = r"pair, part 2 of 2 around \(0.05, 0.55, 0.05\) m: nothing holds.*share no node"
    with pytest.raises(fem.FemInputError, match=message):
        fem.solve_static(model, model.load, SETTINGS)
    held = [fem.Support(f"pair.y_min_{n}", ("x", "y", "z")) for n in (1, 2)]
    fem.solve_static(fem.build_model([body], supports=held), 0.0 * model.load, SETTINGS)


def test_bolts_that_nothing_has_tightened_are_said() -> None:
    """Only until solve_preload has tightened them."""
    shank = fem.Body("shank", box((0.01, 0.05, 0.01), (1, 4, 1)), STEEL)
    model = fem.build_model(
        [shank],
        bolts=[fem.Bolt("screw", "shank", 100.0)],
        supports=[fem.Support(f"shank.y_{end}", ("x", "y", "z")) for end in ("min", "max")],
    )
    with pytest.warns(
        fem.PreloadWarning, match="static solution: bolts screw are not tightened; solve_preload"
    ) as seen:
        state = fem.solve_static(model, model.load, SETTINGS)
    assert seen[0].filename == __file__
    with pytest.warns(fem.PreloadWarning, match="transient: bolts screw"):
        fem.Transient(model, state, fem.no_modes(model, state), fem.Rayleigh(0.0, 0.0), fem.TransientSettings(1e-4))
    locked, tight = fem.solve_preload(model, SETTINGS)
    again = fem.solve_static(locked, locked.load, SETTINGS, start=tight)
    assert locked.bolts.forces(again.u)[0] == pytest.approx(100.0, rel=1e-6)
