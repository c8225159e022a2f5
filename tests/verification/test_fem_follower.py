"""Pressures that turn with their surface: load stiffness, ring buckling, inflation, a bent strip, ledgers in motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import fem
from tests.fem.small_models import STEEL, box, distorted, wave

RADIUS, THICK = 1.0, 0.02
SOFT = fem.Material(1e9, 0.0, 1000.0)


def _ring(thick: float, load: fem.FollowerPressure | fem.Pressure, cells: int = 12) -> fem.Model:
    """A quarter of a ring of unit width in plane strain, nu = 0, symmetric about both axes."""

    def bent(p: np.ndarray) -> np.ndarray:
        return np.column_stack([p[:, 1] * np.cos(p[:, 0]), p[:, 1] * np.sin(p[:, 0]), p[:, 2]])

    lines = [np.linspace(0.5 * np.pi, 0.0, cells + 1)[::-1], [RADIUS - 0.5 * thick, RADIUS + 0.5 * thick], [0.0, 1.0]]
    # Angles grow against the right-handed order of a block: the width runs the other way.
    mesh = fem.hex_block(*lines, mapping=lambda p: bent(p) * [1.0, 1.0, -1.0])
    supports = [
        fem.Support("ring.x_min", ("y",)),
        fem.Support("ring.x_max", ("x",)),
        fem.Support("ring.z_min", ("z",)),
        fem.Support("ring.z_max", ("z",)),
    ]
    return fem.build_model([fem.Body("ring", mesh, SOFT)], supports=supports, loads=[load])


def _under(model: fem.Model, start: fem.StaticState | None = None) -> fem.StaticState:
    return fem.solve_static(model, model.load, fem.StaticSettings(steps=2, solver="superlu"), start=start)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_load_stiffness_is_the_derivative(element: str) -> None:
    """Central differences; quadratic in u, so exact but for rounding: 1e-16 / 1e-4 of the entries."""
    body = fem.Body("b", distorted(box((1.0, 0.8, 0.6), (2, 1, 1), element), 0.05), SOFT)
    model = fem.build_model([body], loads=[fem.FollowerPressure("p", "b.x_max", 3.0)])
    u, h = wave(model.points, 0.2), 1e-4
    stiffness = model.followers.stiffness(u).toarray()
    rng = np.random.default_rng(1)
    for _ in range(3):
        d = rng.normal(size=model.n_dof)
        ahead, behind = (model.followers.force((u + s * h * d)[:, None])[:, 0] for s in (1.0, -1.0))
        difference = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(stiffness @ d, difference, atol=1e-10 * np.abs(difference).max())
    assert np.abs(stiffness - stiffness.T).max() > 0.01 * np.abs(stiffness).max()
    both = model.followers.force(np.column_stack([u, 2.0 * u]))
    for column, share in zip(both.T, (1.0, 2.0), strict=True):
        alone = model.followers.force(share * u[:, None])[:, 0]
        np.testing.assert_allclose(column, alone, atol=1e-14 * np.abs(alone).max())


def test_closed_surfaces_are_in_balance_and_have_a_potential() -> None:
    """Gauss: no resultant force or moment on the whole skin however it deforms, and a symmetric stiffness."""
    body = fem.Body("b", distorted(box((1.0, 0.8, 0.6), (2, 2, 1)), 0.05), SOFT)
    model = fem.build_model([body], loads=[fem.FollowerPressure("p", "b.skin", 3.0)])
    u = wave(model.points, 0.2)
    force = model.followers.force(u[:, None]).reshape(-1, 3)
    largest = np.abs(force).max()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * largest * len(force)
    moment = np.cross(model.points + u.reshape(-1, 3), force).sum(axis=0)
    # A quad8 face has cubic normals against quartic integrands: the 3 x 3 rule is exact to degree 5 each way.
    assert np.abs(moment).max() < 1e-12 * largest * len(force)
    stiffness = model.followers.stiffness(u)
    assert abs(stiffness - stiffness.T).max() < 1e-12 * abs(stiffness).max()
    # At rest it is the dead pressure.
    dead = fem.build_model([body], loads=[fem.Pressure("p", "b.skin", 3.0)])
    np.testing.assert_allclose(model.followers.force(np.zeros((model.n_dof, 1)))[:, 0], dead.load, atol=1e-13)


@pytest.mark.parametrize(("kind", "factor"), [(fem.FollowerPressure, 3.0), (fem.Pressure, 4.0)])
def test_rings_buckle_at_three_and_at_four(kind: type, factor: float) -> None:
    """p = 3 E I / R^3 where the pressure turns with the ring, 4 E I / R^3 where it keeps its direction.

    Levy (1884), Boresi (1955). Pressure on the outer face instead of the mean radius shifts the second by t/R = 2 %; 24
    cells along a quarter are 0.3 % too stiff.
    """
    critical = factor * SOFT.young_modulus * THICK**3 / 12.0 / RADIUS**3
    for share, count in ((0.97, 0), (1.03, 1)):
        model = _ring(THICK, kind("p", "ring.y_max", share * critical), 24)
        assert fem.unstable_directions(model, _under(model)) == count


def test_pressure_on_a_stretched_ring_grows_with_its_surface() -> None:
    """A thin ring of St. Venant-Kirchhoff material: p = E t (lambda^2 - 1) / (2 R), errors of the order of t/R."""
    thick, stretch = 0.005, 1.3
    pressure = SOFT.young_modulus * thick * (stretch**2 - 1.0) / (2.0 * RADIUS)
    model = _ring(thick, fem.FollowerPressure("p", "ring.y_min", pressure))
    state = _under(model)
    rows = fem.sensor_rows(model, [fem.Sensor("r", (RADIUS, 0.0, -0.5), "x")])
    assert 1.0 + (rows @ state.u)[0] == pytest.approx(stretch, abs=2.0 * thick)
    assert state.follower == 1.0
    # Newton is quadratic to the end: the last iterations square the residual.
    last = state.residuals[-3:]
    assert last[-1] < max(1e3 * last[-2] ** 2, 1e-8)
    path = fem.follow_path(model, model.load, fem.PathSettings(solver="superlu"))
    np.testing.assert_allclose(path.displacements[-1], state.u, atol=1e-6 * np.abs(state.u).max())
    half = _under(model.following(0.5))
    np.testing.assert_allclose(_under(model, half).u, state.u, atol=1e-6 * np.abs(state.u).max())
    assert half.follower == 0.5
    # What the symmetry planes hold is the pressure on the opening between them.
    held = fem.reaction(model, state, "ring.x_min")
    assert held[1] == pytest.approx(-pressure * stretch * RADIUS, rel=0.01)


def _strip(pressure: float) -> fem.Model:
    mesh = box((1.0, 0.01, 0.1), (24, 1, 1))
    return fem.build_model(
        [fem.Body("strip", mesh, SOFT)],
        supports=[fem.Support("strip.x_min", ("x", "y", "z")), fem.Support("strip.z_min", ("z",))],
        loads=[fem.FollowerPressure("p", "strip.y_min", pressure)],
    )


def test_strip_under_pressure_on_one_side_bends_as_the_elastica() -> None:
    """theta' = M/EI, M' = -V, V' = N theta' + q, N' = -V theta' with q across the turned strip; no potential."""
    stiffness = SOFT.young_modulus * 0.01**3 / 12.0
    q = 8.0 * stiffness
    model = _strip(q)

    def slope(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        theta, moment, shear, axial = y[:4]
        bend = moment / stiffness
        return np.stack([bend, -shear, -q + axial * bend, -shear * bend, np.cos(theta), np.sin(theta)])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], a[4], a[5], b[1], b[2], b[3]])

    s = np.linspace(0.0, 1.0, 41)
    guess = np.stack([s, q * (1 - s) ** 2 / 2, q * (1 - s), 0 * s, s, 0.2 * s])
    exact = solve_bvp(slope, ends, s, guess, tol=1e-8, max_nodes=10000)
    assert exact.status == 0
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=4, solver="superlu"))
    rows = fem.sensor_rows(model, [fem.Sensor("tip", (1.0, 0.005, 0.05), axis) for axis in "xy"])
    tip = rows @ state.u + [1.0, 0.0]
    assert exact.y[5, -1] > 0.5
    assert tip == pytest.approx(exact.y[4:6, -1], abs=5e-3)


@pytest.mark.parametrize("method", ["anderson", "newton", "explicit"])
def test_motion_under_a_following_pressure_keeps_its_ledger(method: str) -> None:
    """Pressure that begins at once: strain and kinetic energy are its work; reactions carry it with the inertia."""
    body = fem.Body("beam", box((0.3, 0.01, 0.02), (4, 1, 1)), STEEL)
    model = fem.build_model(
        [body],
        supports=[fem.Support("beam.x_min", ("x", "y", "z"))],
        loads=[fem.FollowerPressure("p", "beam.y_min", 2e5)],
    )
    rest, still = fem.rest_state(model), np.zeros((model.n_dof, 1))
    damping = fem.Rayleigh(0.0, 0.0)
    if method == "explicit":
        march: fem.Transient | fem.ExplicitTransient = fem.ExplicitTransient(
            model, rest, damping, fem.ExplicitSettings(5e-5)
        )
    else:
        settings = fem.TransientSettings(5e-5, 1.0, 1e-8, method=method, dispersion_correction=False)
        march = fem.Transient(model, rest, fem.no_modes(model, rest), damping, settings)
    seen = fem.record_history(
        march, march.start(still, still, settled=True), 10 if method == "explicit" else 100, np.zeros((0, model.n_dof))
    )
    through = np.abs(seen.external).max()
    assert through > 1e-3
    assert np.abs(seen.imbalance).max() < 1e-2 * through
    if method == "explicit":
        return
    # Twice the static load at the turn of the first mode, and higher modes: the mean of a period is the load.
    assert seen.reaction[:, 0, 1, 0].mean() == pytest.approx(-2e5 * 0.3 * 0.02, rel=0.2)


def test_static_start_of_a_march_stays_at_rest() -> None:
    """The equilibrium under the pressure is one of the march too; modes about it are those of a bent strip."""
    model = _strip(400.0)
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=4, solver="superlu"))
    modes = fem.solve_modes(model, state, 2, solver="superlu")
    march = fem.Transient(model, state, modes, fem.Rayleigh(0.0, 0.0), fem.TransientSettings(1e-3, solver="superlu"))
    still = np.zeros((model.n_dof, 1))
    rows = fem.sensor_rows(model, [fem.Sensor("tip", (1.0, 0.0, 0.0), "y")])
    seen = fem.record_history(march, march.start(still, still), 5, rows)
    assert np.abs(seen.displacement).max() < 1e-6 * np.abs(state.u).max()
    free = fem.solve_modes(model, fem.rest_state(model), 2, solver="superlu")
    assert free.omega != pytest.approx(modes.omega, rel=1e-3)


def test_following_pressures_that_cannot_be_used() -> None:
    model = _strip(1.0)
    with pytest.raises(fem.FemInputError, match="load p: a pressure that follows has no dead force"):
        fem.time_load(model, fem.FollowerPressure("p", "strip.y_min", 1.0), lambda t: t)
    with pytest.raises(fem.FemInputError, match="load p: unknown surface"):
        fem.build_model(model.bodies, loads=[fem.FollowerPressure("p", "strip.top", 1.0)])
    with pytest.raises(fem.FemInputError, match="load p: the load is not finite"):
        fem.build_model(model.bodies, loads=[fem.FollowerPressure("p", "strip.y_min", np.nan)])
