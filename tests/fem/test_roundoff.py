"""Residuals that rounding keeps above the tolerance: thin parts under small loads come to an end all the same."""

from __future__ import annotations

import numpy as np
import pytest

import fem
from fem.newton import internal_force
from fem.roundoff import rounding_force
from fem.snap_back import hold_modes

LENGTH, THICKNESS = 0.3, 0.0005
CELLS = 24


def thin_strip() -> fem.Model:
    """300 x 0.5 mm under its own weight: the tip sinks by 35 times the thickness."""
    steel = fem.Material(young_modulus=200e9, poisson_ratio=0.0, density=7800.0)
    lines = np.linspace(0.0, LENGTH, CELLS + 1), np.array([0.0, THICKNESS]), np.array([0.0, 0.02])
    return fem.build_model(
        [fem.Body("strip", fem.hex_block(*lines), steel)],
        supports=[fem.Support("strip.x_min", ("x", "y", "z"))],
        loads=[fem.Gravity("weight", (0.0, -9.81, 0.0))],
    )


def residual(model: fem.Model, state: fem.StaticState) -> float:
    slip = model.contact.no_slip(1)
    return float(np.linalg.norm((model.load - internal_force(model, state.u, slip)[0])[model.free]))


def test_thin_strip_comes_to_rest_at_what_rounding_leaves() -> None:
    """The default tolerance of 1e-8 is out of reach here; a looser one that is in reach has the same answer."""
    model = thin_strip()
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=1))
    left = residual(model, state)
    bound = rounding_force(model, state.u, model.contact.no_slip(1)[:, :, 0])
    assert 1e-8 * np.linalg.norm(model.load) < left <= bound
    loose = fem.solve_static(model, model.load, fem.StaticSettings(steps=1, tolerance=1e-4))
    tip = np.abs(state.u).max()
    assert tip == pytest.approx(np.abs(loose.u).max(), rel=1e-4)
    # straight beam: 18.6 mm; turning by up to 5 degrees takes 1 %, cells 25 times as long as thick 5 %
    straight = 7800.0 * 9.81 * LENGTH**4 / (8.0 * 200e9 * THICKNESS**2 / 12.0)
    assert 0.9 * straight < tip < straight


def test_path_of_a_thin_strip_ends_at_the_full_load() -> None:
    model = thin_strip()
    path = fem.follow_path(model, model.load)
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=1))
    assert path.load_factors[-1] == 1.0
    assert np.abs(path.displacements[-1] - state.u).max() < 1e-4 * np.abs(state.u).max()


def test_bound_holds_what_rounding_the_displacement_once_changes() -> None:
    model = thin_strip()
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=1))
    slip = model.contact.no_slip(1)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], model.n_dof)
    moved = state.u * (1.0 + np.finfo(float).eps * signs)
    change = internal_force(model, moved, slip)[0] - internal_force(model, state.u, slip)[0]
    share = np.linalg.norm(change[model.free]) / rounding_force(model, state.u, slip[:, :, 0])
    assert 1e-3 < share < 1.0


def test_residual_above_that_bound_is_refused() -> None:
    model = thin_strip()
    with pytest.raises(fem.FemConvergenceError, match="relative residual"):
        fem.solve_static(model, model.load, fem.StaticSettings(steps=1, max_iterations=2, cuts=0))


def test_thin_strip_is_held_in_the_shape_of_its_first_mode() -> None:
    """0.3 mm thick, clamped at both ends: rounding leaves 8e-6 of the modal force, the default tolerance is 1e-6."""
    steel = fem.Material(young_modulus=200e9, poisson_ratio=0.3, density=7800.0)
    lines = np.linspace(0.0, LENGTH, 33), np.array([0.0, 0.0003]), np.linspace(0.0, 0.02, 2)
    held = [fem.Support(f"strip.{end}", ("x", "y", "z")) for end in ("x_min", "x_max")]
    model = fem.build_model([fem.Body("strip", fem.hex_block(*lines), steel)], supports=held)
    rest = fem.rest_state(model)
    modes = fem.solve_modes(model, rest, 2)
    eta = np.array([1e-3 / np.abs(modes.shapes[:, 0]).max()])
    state = hold_modes(model, rest, modes, eta)
    assert modes.left[:, :1].T @ state.u == pytest.approx(eta, rel=1e-6)
    slip = model.contact.no_slip(1)
    force = internal_force(model, state.u, slip)[0]
    c = modes.shapes[:, 0] @ force
    left = np.linalg.norm((force - modes.left[:, 0] * c)[model.free])
    assert left <= rounding_force(model, state.u, slip[:, :, 0])


def loaded_beam() -> tuple[fem.Model, fem.StaticState, fem.ModalBasis]:
    """A cantilever of 1 m under its own weight, at rest."""
    steel = fem.Material(young_modulus=210e9, poisson_ratio=0.3, density=7800.0)
    lines = np.linspace(0.0, 1.0, 5), np.array([0.0, 0.05]), np.array([0.0, 0.05])
    model = fem.build_model(
        [fem.Body("beam", fem.hex_block(*lines), steel)],
        supports=[fem.Support("beam.x_min", ("x", "y", "z"))],
        loads=[fem.Gravity("weight", (0.0, 0.0, -9.81))],
    )
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=1))
    return model, state, fem.solve_modes(model, state, 2)


def pulse(t: float) -> float:
    """Nothing for 2 ms, then half a sine of 4 ms."""
    return float(np.sin(np.pi * (t - 2e-3) / 4e-3)) if 2e-3 < t < 6e-3 else 0.0


@pytest.mark.parametrize(
    "settings",
    [
        fem.TransientSettings(1e-4),
        fem.TransientSettings(1e-4, method="newton"),
        fem.TransientSettings(1e-4, error_tolerance=1e-3),
    ],
)
def test_loaded_structure_rests_until_it_is_struck(settings: fem.TransientSettings) -> None:
    """Neither inertia nor a change of the load measures the residual before; the local error has no motion either."""
    model, state, modes = loaded_beam()
    blow = fem.time_load(model, fem.Force("blow", "beam.x_max", (0.0, 0.0, -100.0)), pulse)
    march = fem.Transient(model, state, modes, fem.Rayleigh(5.0, 0.0), settings, loads=[blow])
    still = np.zeros((model.n_dof, 1))
    rows = fem.sensor_rows(model, [fem.Sensor("tip", (1.0, 0.05, 0.05), "z")])
    seen = fem.record_history(march, march.start(still, still), 100, rows).displacement[:, 0, 0]
    assert np.abs(seen[:20]).max() < 1e-6 * np.abs(seen).max()
    # impulse over modal mass: P 2 tau / pi phi^2 / omega, the blow lasting a fifth of a period: 0.95 of it at most
    impulsive = 100.0 * 2.0 * 4e-3 / np.pi * float(np.sum((rows @ modes.shapes) ** 2)) / modes.omega[0]
    assert 0.8 * impulsive < np.abs(seen).max() < 1.1 * impulsive
