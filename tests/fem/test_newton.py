"""The load step: quadratic contraction, cut-back, closing of gaps, failures that say what and where."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from fem.block import graded, hex_block
from fem.contact_report import penalty_reports
from fem.equilibrium import interface_states
from fem.errors import FemConvergenceError, FemInputError
from fem.loads import Force
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Clamp, Model, Pair, Support, build_model
from fem.newton import internal_force
from fem.preload import StaticSettings, StaticState, solve_static
from fem.sliding import SlidingWarning, sliding_motion, sliding_notes
from tests.fem.small_models import STEEL, box, clamped_strip, wave

ONE_STEP = StaticSettings(steps=1, solver="superlu")


def _pull(model: Model, force: float) -> np.ndarray:
    """Transverse force shared by the nodes of the symmetry cut of the strip, N."""
    nodes = np.unique(model.facets("panel.x_min"))
    load = model.load.copy()
    load[3 * nodes + 1] += force / len(nodes)
    return load


def test_newton_contracts_quadratically_with_slip() -> None:
    """Order of the last contraction, with open and slipping points: 2, less what roundoff at 1e-11 takes (0.3)."""
    model = clamped_strip()
    start = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    settings = StaticSettings(steps=1, tolerance=1e-9, solver="superlu")
    state = solve_static(model, _pull(model, 400.0), settings, start=start)
    assert np.any(state.contact.status == 2)
    assert np.any(state.contact.status == 0)
    residual = np.array(state.residuals)
    order = np.diff(np.log(residual[1:])) / np.diff(np.log(residual[:-1]))
    assert order[-1] > 1.6
    assert residual[-1] < 1e-3 * residual[-2]


def _blocks(gap: float, *, friction: float = 0.3, pull: bool = False) -> Model:
    """A loose cube pressed (or pulled) along y, ``gap`` m above one that stands; meshes do not match."""
    material = Material(2e6, 0.0, 1000.0)
    lower, upper = box((1.0, 1.0, 1.0), (3, 1, 3)), box((1.0, 1.0, 1.0), (2, 1, 2), shift=1.0 + gap)
    sides = [Support(f"{body}.{axis}_min", (axis,)) for body in ("lower", "upper") for axis in "xz"]
    return build_model(
        [Body("lower", lower, material, "linear"), Body("upper", upper, material, "linear")],
        pairs=[Pair("joint", "upper.y_min", "lower.y_max", friction)],
        supports=[Support("lower.y_min", ("y",)), *sides],
        clamps=[Clamp("press", "upper.y_max", -1e4 if pull else 1e4)],
    )


@pytest.mark.parametrize("gap", [0.0, 1e-3, 0.1])
def test_load_closes_a_gap(gap: float) -> None:
    """Uniform pressure after closing, whatever the gap; the cube comes down by it."""
    model = _blocks(gap)
    state = solve_static(model, model.load, ONE_STEP)
    joint = interface_states(model, state.u, state.contact)[0]
    np.testing.assert_allclose(joint.pressure, 1e4, rtol=1e-7)
    down = -state.u.reshape(-1, 3)[np.unique(model.facets("upper.y_min")), 1]
    np.testing.assert_allclose(down, gap + 1e4 / 2e6 + 1e4 / model.contact.law[0, 0], rtol=1e-7)


def test_interface_that_never_closes_is_named() -> None:
    model = _blocks(1e-3, pull=True)
    with pytest.raises(FemInputError, match=r"contact joint: the interface never closes; got upper free"):
        solve_static(model, model.load, ONE_STEP)


def _ring(radii: tuple[float, float], cells: int) -> Mesh:
    """A quarter ring about z, 5 mm long, sides of y = 0 and x = 0 by the names y_min and y_max."""

    def bend(points: np.ndarray) -> np.ndarray:
        r, angle, z = points.T
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])

    lines = (graded(list(radii), [2]), graded([0.0, 0.5 * np.pi], [cells]), graded([0.0, 0.005], [1]))
    return hex_block(*lines, mapping=bend)


@pytest.mark.parametrize(("clearance", "friction"), [(1e-5, 0.0), (2e-4, 0.0), (5e-5, 0.2)])
def test_pin_in_a_hole_bears_on_one_side(clearance: float, friction: float) -> None:
    """Gaps all around: drawn together everywhere the pin would open again; the load brings it to one side of the hole.

    Half a model of a pin pushed along y: the hole carries the force, and the pin has moved by the clearance and by
    what the parts and the joint give.
    """
    pin, plate = _ring((0.004, 0.01 - clearance), 10), _ring((0.01, 0.02), 12)
    model = build_model(
        [Body("pin", pin, STEEL), Body("plate", plate, STEEL)],
        pairs=[Pair("hole", "pin.x_max", "plate.x_min", friction)],
        supports=[
            Support("plate.x_max", ("x", "y", "z")),
            Support("plate.y_max", ("x",)),
            Support("pin.y_max", ("x",)),
            Support("pin.z_min", ("z",)),
        ],
        loads=[Force("push", "pin.x_min", (0.0, 500.0, 0.0))],
    )
    state = solve_static(model, model.load, ONE_STEP)
    hole = interface_states(model, state.u, state.contact)[0]
    assert hole.force[1] == pytest.approx(500.0, rel=1e-6)
    assert 0.0 < hole.contact_area < 0.5 * 0.01 * 0.5 * np.pi * 0.005
    top = int(np.argmax(pin.points[:, 1]))
    assert clearance < state.u[3 * top + 1] < clearance + 6e-6


def test_step_that_fails_is_cut() -> None:
    """Eight iterations are too few for the whole load, and enough for parts of it; the end is the same."""
    model = clamped_strip()
    start = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    load = _pull(model, 400.0)
    whole = solve_static(model, load, ONE_STEP, start=start)
    few = StaticSettings(steps=1, max_iterations=8, solver="superlu", cuts=8)
    cut = solve_static(model, load, few, start=start)
    assert len(cut.load_factors) > 1
    assert cut.load_factors[-1] == 1.0
    assert np.all(np.diff(cut.load_factors) > 0.0)
    # Friction remembers the way: the cut path slips in other steps.
    np.testing.assert_allclose(cut.u, whole.u, atol=1e-3 * np.abs(whole.u).max())


def test_failure_says_how_far_it_came() -> None:
    model = clamped_strip()
    start = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    with pytest.raises(FemConvergenceError) as caught:
        solve_static(
            model,
            _pull(model, 400.0),
            StaticSettings(steps=2, max_iterations=3, cuts=1, solver="superlu"),
            start=start,
        )
    text = str(caught.value)
    assert "load factor" in text
    assert "lower" in text
    assert "stick" in text
    last = caught.value.last_good
    assert isinstance(last, StaticState)
    assert np.isfinite(last.u).all()


def _squeezed(shear: float, *, press: float = 1e-4, mesh: tuple[int, int] = (2, 3)) -> tuple[Model, np.ndarray]:
    """Two cubes of Green-Lagrange steel, the upper pressed in and pushed along x (m); a smooth wave on top."""
    lower, upper = box((1.0, 1.0, 1.0), (mesh[1], 1, mesh[1])), box((1.0, 1.0, 1.0), (mesh[0], 1, mesh[0]), shift=1.0)
    model = build_model(
        [Body("lower", lower, STEEL), Body("upper", upper, STEEL)],
        pairs=[Pair("joint", "upper.y_min", "lower.y_max", 0.3)],
    )
    u = wave(model.points, 1e-6).reshape(-1, 3)
    u[model.offsets[1] :] += [shear, -press, 0.0]
    return model, u.ravel()


@pytest.mark.parametrize(
    ("shear", "press", "status"),
    [(1e-5, 1e-4, 1), (1e-3, 1e-4, 2), (1e-5, -1e-4, 0)],
    ids=["stick", "slip", "open"],
)
def test_tangent_of_the_whole_model_equals_central_differences(shear: float, press: float, status: int) -> None:
    """Bodies and contact together, away from transitions: all points keep their state in both differences."""
    model, u = _squeezed(shear, press=press)
    slip = model.contact.no_slip(1)
    direction = wave(model.points[:, ::-1].copy(), 1.0)
    h = 1e-9
    forces = []
    for sign in (1.0, -1.0):
        force, state = internal_force(model, u + sign * h * direction, slip)
        assert np.all(state.status == status)
        forces.append(force)
    difference = (forces[0] - forces[1]) / (2.0 * h)
    tangent = (model.elastic_tangent(u) + model.contact.tangent(u, slip[:, :, 0])) @ direction
    # Truncation (h / slip)^2 < 1e-8, roundoff 1e-16 u / h = 1e-10.
    np.testing.assert_allclose(tangent, difference, atol=1e-6 * np.abs(difference).max())


def _slid(distance: float) -> tuple[Model, StaticState]:
    """The loose cube pressed on, then moved along x as a whole by its supports."""
    model = _blocks(0.0)
    supports = [*model.supports, Support("lower.skin", ("x",)), Support("upper.skin", ("x",))]
    pressed = build_model(model.bodies, pairs=model.pairs, supports=supports, clamps=model.clamps)
    start = solve_static(pressed, pressed.load, ONE_STEP)
    sideways = np.zeros((len(model.points), 3))
    sideways[np.unique(model.facets("upper.skin")), 0] = distance
    driven = replace(pressed, prescribed=sideways.ravel())
    return driven, solve_static(driven, driven.load, StaticSettings(steps=4, solver="superlu"), start=start)


def test_slip_beyond_the_small_sliding_range_warns() -> None:
    """A tenth of the master facet of 1/3 m: 33 mm; twice that warns with pair, distance and limit, half does not."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", SlidingWarning)
        model, state = _slid(0.016)
    motion = sliding_motion(model.contact, model.contact.relative(state.u[:, None]), state.contact.status)
    assert sliding_notes(model.contact, motion) == ()
    with pytest.warns(SlidingWarning, match=r"contact joint: points slid by 0\.06.* more than the 0\.0333 m"):
        _slid(0.066)


def test_sliding_block_reports_slip_friction_work_and_penalties() -> None:
    """Traction mu p, work mu p (d - mu p / k_t) per area, slip d - mu p / k_t: every point in closed form; 1e-7."""
    distance, pressure = 0.016, 1e4
    model, state = _slid(distance)
    joint = interface_states(model, state.u, state.contact, dissipated=state.dissipated)[0]
    slip = distance - 0.3 * pressure / model.contact.law[0, 1]
    assert np.all(joint.status == 2)
    np.testing.assert_allclose(np.linalg.norm(joint.traction, axis=1), 0.3 * pressure, rtol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(joint.slip, axis=1), slip, rtol=1e-7)
    np.testing.assert_allclose(joint.dissipated, 0.3 * pressure * slip, rtol=1e-7)
    report = penalty_reports(model, state)[0]
    assert report.penetration == pytest.approx(joint.pressure.max() / model.contact.law[0, 0], rel=1e-12)
    assert report.penetration_in_facets == pytest.approx(2.0 * report.penetration, rel=1e-9)
    assert report.real_slip == pytest.approx(np.linalg.norm(joint.slip, axis=1).max(), rel=1e-12)
    assert report.elastic_slip == pytest.approx(0.3 * pressure / model.contact.law[0, 1], rel=1e-7)
    # Penalty energy p^2 / 2k + tau^2 / 2k against p^2 / 2E over a height of 2 m, k = E / 0.5 m.
    assert report.compliance_share == pytest.approx(0.5 * (1.0 + 0.3**2) / 2.0, rel=1e-6)


def test_force_on_a_stuck_joint_is_what_the_points_carry() -> None:
    """Sum of the traction vectors over the areas, turned by the frames, against the force applied: 1e-8."""
    model = _blocks(0.0)
    push = build_model(
        model.bodies,
        pairs=model.pairs,
        supports=[s for s in model.supports if s.surface != "upper.x_min"],
        clamps=model.clamps,
        loads=[Force("push", "upper.y_min", (500.0, 0.0, 0.0))],
    )
    state = solve_static(push, push.load, ONE_STEP)
    joint = interface_states(push, state.u, state.contact)[0]
    np.testing.assert_allclose(joint.force, [500.0, -1e4, 0.0], atol=1e-4)


def test_large_models_reach_the_same_state_without_unsymmetric_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both stop at 1e-9 of the load: limit 1e-5 of the displacement, for a compliance 1e4 times the mean one."""
    model = clamped_strip()
    start = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    settings = StaticSettings(steps=1, tolerance=1e-9, solver="superlu")
    direct = solve_static(model, _pull(model, 400.0), settings, start=start)
    monkeypatch.setattr("fem.newton.LARGE", 0)
    closed = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    scale = np.abs(direct.u).max()
    assert np.abs(closed.u - start.u).max() < 1e-5 * scale
    krylov = solve_static(model, _pull(model, 400.0), settings, start=closed)
    assert np.abs(krylov.u - direct.u).max() < 1e-5 * scale
    np.testing.assert_array_equal(krylov.contact.status, direct.contact.status)
