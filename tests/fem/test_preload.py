"""Static equilibrium: resultants, solver choice, restarts, failures that say what to do."""

from __future__ import annotations

import numpy as np
import pytest

from fem.block import graded, hex_block
from fem.equilibrium import applied_force, interface_states
from fem.errors import FemConvergenceError, FemInputError
from fem.linear_solver import available_solvers
from fem.loads import Pressure
from fem.material import Material
from fem.model import Body, Model, Pair, Support, build_model
from fem.preload import StaticSettings, StaticState, solve_static
from tests.fem.conftest import Strip
from tests.fem.small_models import clamped_strip

SETTINGS = StaticSettings(steps=2, solver="superlu")


def _with_supports(model: Model, supports: tuple[Support, ...]) -> Model:
    return build_model(model.bodies, pairs=model.pairs, supports=supports, clamps=model.clamps)


def test_equilibrium_balances_all_free_forces(strip: Strip) -> None:
    model, state = strip.model, strip.equilibrium
    force = model.elastic_force(state.u[:, None])[0] + model.contact.force(state.contact.traction)
    residual = (model.load - force[:, 0])[model.free]
    assert np.linalg.norm(residual) <= SETTINGS.tolerance * np.linalg.norm(model.load)
    assert state.load_factors == (0.5, 1.0)
    np.testing.assert_array_equal(state.u[~model.free], 0.0)


def test_interfaces_carry_the_clamping_force(strip: Strip) -> None:
    """Balance of the blade: exact to the tolerance of the equilibrium."""
    for interface in interface_states(strip.model, strip.equilibrium.u, strip.equilibrium.contact):
        assert interface.applied_force == pytest.approx(4e3, rel=1e-12)
        assert interface.normal_force == pytest.approx(4e3, rel=1e-7)
        assert interface.contact_area == pytest.approx(0.02 * 0.02, rel=1e-12)
        assert np.all(interface.gap < 0.0)
        shear = np.linalg.norm(interface.traction, axis=1)
        assert np.all(shear <= 0.3 * interface.pressure * (1.0 + 1e-12))


def test_force_between_two_supports_is_not_determined() -> None:
    model = clamped_strip()
    both = _with_supports(model, (*model.supports, Support("blade.y_max", ("y",)), Support("panel.x_min", ("y",))))
    assert np.isnan(applied_force(both, 0))


@pytest.mark.parametrize("solver", available_solvers())
def test_solvers_find_the_same_state(strip: Strip, solver: str) -> None:
    state = solve_static(strip.model, strip.model.load, StaticSettings(steps=2, solver=solver))
    np.testing.assert_allclose(state.u, strip.equilibrium.u, atol=1e-7 * np.abs(state.u).max())


def test_restart_from_balance_stays(strip: Strip) -> None:
    again = solve_static(strip.model, strip.model.load, SETTINGS, start=strip.equilibrium)
    assert len(again.residuals) == 2
    np.testing.assert_array_equal(again.u, strip.equilibrium.u)


def test_progress_reports_the_load_factor() -> None:
    model = clamped_strip(clamp=100.0)
    seen: list[float] = []
    solve_static(model, model.load, StaticSettings(steps=3, solver="superlu"), progress=seen.append)
    assert seen == pytest.approx([1 / 3, 2 / 3, 1.0])


def test_failure_has_history_and_last_good_state() -> None:
    """The first step is solved linearly well enough; the second asks for more than one iteration."""
    model = clamped_strip()
    start = solve_static(model, model.load, SETTINGS)
    pull = model.load + 2e3 * strip_pull(model)
    with pytest.raises(FemConvergenceError, match="use more load steps") as caught:
        solve_static(model, pull, StaticSettings(steps=4, max_iterations=2, solver="superlu"), start=start)
    assert len(caught.value.history) >= 2
    last = caught.value.last_good
    assert isinstance(last, StaticState)
    assert len(last.load_factors) < 4
    force = model.elastic_force(last.u[:, None])[0] + model.contact.force(last.contact.traction)
    factor = last.load_factors[-1] if last.load_factors else 0.0
    target = model.load + factor * (pull - model.load)
    assert np.linalg.norm((target - force[:, 0])[model.free]) <= 1e-7 * np.linalg.norm(pull)


def strip_pull(model: Model) -> np.ndarray:
    """Unit transverse force shared by the nodes of the symmetry cut."""
    nodes = np.unique(model.facets("panel.x_min"))
    pull = np.zeros(model.n_dof)
    pull[3 * nodes + 1] = 1.0 / len(nodes)
    return pull


@pytest.mark.parametrize("without", ["support.y_min", "all"])
def test_loose_part_is_named_before_anything_is_solved(without: str) -> None:
    model = clamped_strip()
    kept = tuple(s for s in model.supports if without not in ("all", s.surface))
    with pytest.raises(FemInputError, match=r"panel.*support.*blade.*free to (translate|rotate)"):
        solve_static(_with_supports(model, kept), model.load, SETTINGS)


def test_friction_holds_a_part_and_a_frictionless_one_is_loose() -> None:
    """Without its symmetry the panel is held along x by friction only."""
    model = clamped_strip()
    solve_static(_with_supports(model, model.supports[1:]), model.load, SETTINGS)
    slippery = clamped_strip(friction=0.0)
    with pytest.raises(FemInputError, match=r"panel: .*translate along x"):
        solve_static(_with_supports(slippery, slippery.supports[1:]), slippery.load, SETTINGS)


def test_nan_in_the_load_stops_with_a_history(strip: Strip) -> None:
    load = strip.model.load.copy()
    load[np.flatnonzero(strip.model.free)[0]] = np.nan
    with pytest.raises((FemConvergenceError, FemInputError)):
        solve_static(strip.model, load, SETTINGS)


GAP = 5e-4


def _sheets(pressure: float, pairs: tuple[Pair, ...]) -> Model:
    """Two sheets of 300 x 2 mm, clamped at both ends, GAP apart; the upper one is pressed towards the lower one."""
    across = graded([0.0, 0.05], [2])
    steel = Material(2.1e11, 0.3, 7850.0)
    lower = hex_block(graded([0.0, 0.3], [12]), graded([0.0, 0.002], [1]), across)
    upper = hex_block(graded([0.0, 0.3], [10]), graded([0.002 + GAP, 0.004 + GAP], [1]), across)
    ends = [Support(f"{body}.x_{end}", "xyz") for body in ("lower", "upper") for end in ("min", "max")]
    bodies = [Body("lower", lower, steel), Body("upper", upper, steel)]
    return build_model(bodies, pairs=pairs, supports=ends, loads=[Pressure("p", "upper.y_max", pressure)])


def test_held_parts_with_a_gap_between_them_meet_only_where_the_load_closes_it() -> None:
    """Drawn together first, the sheets never found back: 0.39 mm of the gap are used at 3 kPa, 30 kPa close it."""
    pair = (Pair("joint", "upper.y_min", "lower.y_max", 0.2),)
    apart, alone = _sheets(3e3, pair), _sheets(3e3, ())
    free = solve_static(alone, alone.load, StaticSettings()).u
    assert -GAP < free.reshape(-1, 3)[:, 1].min() < -0.7 * GAP
    np.testing.assert_allclose(
        solve_static(apart, apart.load, StaticSettings()).u, free, atol=1e-8 * np.abs(free).max()
    )
    pressed = _sheets(3e4, pair)
    state = solve_static(pressed, pressed.load, StaticSettings())
    gap = pressed.contact.initial_gap + pressed.contact.relative(state.u[:, None])[::3, 0]
    (joint,) = interface_states(pressed, state.u, state.contact)
    # the sheets meet: what the penalty of E / h lets in is nothing beside the gap
    assert -1e-3 * GAP < gap.min() < 0.0
    # the lower sheet takes at most half of the 450 N, its ends none of it
    assert 50.0 < joint.normal_force < 225.0
