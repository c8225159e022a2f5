"""Static equilibrium: resultants, solver choice, restarts, failures that say what to do."""

from __future__ import annotations

import numpy as np
import pytest

from fem.equilibrium import applied_force, interface_states
from fem.errors import FemConvergenceError, FemInputError
from fem.linear_solver import available_solvers
from fem.model import Model, Support, build_model
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
