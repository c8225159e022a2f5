"""Arguments that cannot be meant are refused in one line that says what is wrong, before anything runs with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fem
from tests.fem.small_models import STEEL, blocks, box, single

NAN, INF = float("nan"), float("inf")
BODY = fem.Body("beam", box((0.3, 0.2, 0.1), (2, 1, 1)), STEEL, "linear")
ROOT = fem.Support("beam.x_min", ("x", "y", "z"))
MODEL = fem.build_model([BODY], supports=[ROOT])
OTHER = single(box((1.0, 1.0, 1.0), (1, 1, 1)))
REST = fem.rest_state(MODEL)
ZERO = np.zeros((MODEL.n_dof, 1))
STILL = fem.Rayleigh(0.0, 0.0)
SETTINGS = fem.StaticSettings(solver="superlu")
LOAD = fem.Force("f", "beam.x_max", (0.0, 1.0, 0.0))


def _loaded(load: object) -> fem.Model:
    return fem.build_model([BODY], loads=[load])


def _sprung(*arguments: object) -> fem.Model:
    return fem.build_model([BODY], springs=[fem.Spring("s", *arguments)])


def _joined(**options: object) -> fem.Model:
    model = blocks()
    return fem.build_model(model.bodies, pairs=[replace(model.pairs[0], **options)])


def _transient(**options: object) -> fem.Transient:
    settings = fem.TransientSettings(1e-4, solver="superlu")
    return fem.Transient(MODEL, REST, fem.no_modes(MODEL, REST), STILL, settings, **options)


def _explicit(**options: object) -> fem.ExplicitTransient:
    return fem.ExplicitTransient(MODEL, REST, STILL, fem.ExplicitSettings(1e-4, solver="superlu"), **options)


def _response(**options: object) -> object:
    given = {"load": MODEL.load, "sensors": np.zeros((1, MODEL.n_dof)), "frequency_hz": [10.0], **options}
    return fem.frequency_response(_modes(), STILL, given["load"], given["sensors"], given["frequency_hz"])


def _recorded(n_step: object, sensors: object) -> object:
    march = _explicit()
    return fem.record_history(march, march.start(ZERO, ZERO), n_step, sensors)


def _moved(vector: object) -> object:
    return fem.support_motion(MODEL, "beam.x_min", ("x", "y"), lambda t: 0.0, vector=vector)


def _modes() -> fem.ModalBasis:
    return fem.solve_modes(MODEL, REST, 3, solver="superlu")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fem.TransientSettings(INF), "time step must be positive and finite"),
        (
            lambda: fem.TransientSettings(1e-4, spectral_radius=1.1),
            "spectral_radius out of range; got 1.1; give a number",
        ),
        (lambda: fem.TransientSettings(1e-4, corrected_modes=-1), "corrected_modes out of range"),
        (lambda: fem.TransientSettings(1e-4, error_tolerance=INF), "error tolerance must be positive"),
        (lambda: fem.TransientSettings(1e-4, tolerance="tight"), "tolerance out of range; got tight"),
        (lambda: fem.ExplicitSettings(INF), "time step must be positive and finite"),
        (lambda: fem.StaticSettings(steps=2.5), "static settings: steps out of range; got 2.5; give a whole number"),
        (lambda: fem.StaticSettings(max_iterations=30.0), "max_iterations out of range; got 30.0"),
        (lambda: fem.PathSettings(max_steps=1.5), "path settings: max_steps out of range"),
        (lambda: fem.TransientSettings(1e-4, depth=1.5), "transient: depth out of range"),
        (lambda: fem.TransientSettings(1e-4, max_doublings=NAN), "transient: max_doublings out of range"),
        (lambda: fem.solve_modes(MODEL, REST, 2.5), "modes: count out of range; got 2.5"),
        (lambda: fem.graded([0.0, 1.0], [1.5]), "block: a cell count out of range; got 1.5"),
        (lambda: fem.graded([0.0, 1.0], [0]), "block: a cell count out of range; got 0"),
        (lambda: next(_transient().march(None, 2.5)), "transient: n_step out of range"),
        (lambda: next(_explicit().march(None, 2.5)), "transient: n_step out of range"),
        (lambda: _transient(force_scale=0.0), "force_scale out of range"),
        (lambda: fem.Material(INF, 0.3, 7800.0), "Young's modulus must be positive and finite"),
        (lambda: fem.Material(2e11, NAN, 7800.0), "Poisson's ratio"),
        (lambda: fem.Material(2e11, 0.3, INF), "density must be positive and finite"),
        (lambda: fem.Material("2e11", 0.3, 7800.0), "Young's modulus must be positive and finite; got 2e11"),
        (lambda: fem.Material(None, 0.3, 7800.0), "Young's modulus must be positive"),
        (lambda: fem.Material(np.array([2e11, 1e11]), 0.3, 7800.0), "Young's modulus must be positive"),
        (lambda: fem.TransientSettings("1e-4"), "time step must be positive and finite; got 1e-4"),
        (lambda: fem.TransientSettings(1e-4, error_tolerance="1e-3"), "error tolerance must be positive"),
        (lambda: fem.ExplicitSettings(None), "time step must be positive and finite"),
        (lambda: fem.ExplicitSettings(1e-4, safety="0.9"), "safety must lie in"),
        (lambda: fem.Bolt("bolt", "shank", "9.1e3"), "the bolt force must be positive; got 9.1e3"),
        (lambda: _joined(friction=INF), "joint joint: friction out of range"),
        (lambda: _joined(friction=-0.1), "joint joint: friction out of range"),
        (lambda: _joined(normal_penalty=INF), "joint joint: normal_penalty out of range"),
        (lambda: _joined(tangential_penalty=-1.0), "joint joint: tangential_penalty out of range"),
        (lambda: _joined(stiffness=INF), "joint joint: stiffness must be positive and finite"),
        (lambda: _joined(reach=NAN), "joint joint: reach out of range"),
    ],
)
def test_numbers_out_of_range(make: Callable[[], object], message: str) -> None:
    with pytest.raises(fem.FemInputError, match=message):
        make()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: _loaded(fem.Force("f", "beam.x_max", (1.0, 2.0))), "load f: the load has the wrong shape"),
        (lambda: _loaded(fem.Force("f", "beam.x_max", 3.0)), "got 3.0; give three numbers"),
        (lambda: _loaded(fem.Force("f", "beam.x_max", "down")), "load f: the load is not made of numbers"),
        (lambda: _loaded(fem.Traction("t", "beam.x_max", (1.0, 2.0))), "load t: the load has the wrong shape"),
        (lambda: _loaded(fem.Gravity("g", -9.81)), "load g: the acceleration has the wrong shape"),
        (lambda: _loaded(fem.Gravity("g", (0.0, -9.81))), "load g: the acceleration has the wrong shape"),
        (lambda: _loaded(fem.PointForce("p", (0.1, 0.1, 0.05), (1.0, 2.0))), "load p: the load has the wrong shape"),
        (lambda: _loaded(fem.PointForce("p", (0.1, 0.1), (1.0, 2.0, 3.0))), "load p: the point has the wrong shape"),
        (lambda: _loaded(fem.Pressure("p", "beam.x_max", (1.0, 2.0, 3.0))), "load p: .* give one number"),
        (lambda: _loaded(fem.Clamp("c", "beam.x_max", (1.0, 2.0))), "load c: .* give one number"),
        (lambda: _sprung((0.1, 0.1, 0.05), 1e6), "spring s: the stiffness has the wrong shape"),
        (lambda: _sprung((0.1, 0.1, 0.05), (1e6, 1e6)), "spring s: the stiffness has the wrong shape"),
        (lambda: _sprung((0.1, 0.1), (1e6, 1e6, 1e6)), "spring s: the point has the wrong shape"),
        (lambda: fem.sensor_rows(MODEL, [fem.Sensor("a", (0.1, 0.1), "x")]), "sensor a: the point has the wrong shape"),
        (lambda: fem.hex_block([0.0, 1.0], [0.0, 1.0], [1.0, 0.0]), "block, z: at least two increasing"),
        (lambda: fem.hex_block([0.0, 1.0], 2.0, [0.0, 1.0]), "the grid lines along y has the wrong shape"),
        (lambda: fem.Mesh([[0.0, 1.0]], [list(range(20))], "hex20", {}), "not a table of points"),
        (
            lambda: fem.Mesh([[0.0], [1.0, 2.0]], [list(range(20))], "hex20", {}),
            "table of points is not made of numbers",
        ),
        (lambda: fem.Mesh(np.zeros((20, 3)), np.full((1, 20), 0.5), "hex20", {}), "node numbers must be whole"),
    ],
)
def test_parts_of_a_model(make: Callable[[], object], message: str) -> None:
    with pytest.raises(fem.FemInputError, match=message):
        make()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fem.solve_static(MODEL, MODEL.load[:-1], SETTINGS), "the load has the wrong shape"),
        (lambda: fem.solve_static(MODEL, 1.0, SETTINGS), "the load has the wrong shape"),
        (
            lambda: fem.solve_static(MODEL, MODEL.load, SETTINGS, start=fem.rest_state(OTHER)),
            "belongs to another model",
        ),
        (lambda: fem.follow_path(MODEL, MODEL.load[:-1]), "the load has the wrong shape"),
        (lambda: fem.follow_path(MODEL, ZERO[:, 0] + 1.0, start=fem.rest_state(OTHER)), "belongs to another model"),
        (lambda: fem.solve_modes(MODEL, fem.rest_state(OTHER), 2), "belongs to another model"),
        (lambda: fem.solve_modes(MODEL, REST, 0), "modes: count out of range"),
        (lambda: fem.solve_modes(MODEL, REST, -1), "modes: count out of range"),
        (lambda: fem.solve_modes(MODEL, REST, 2.5), "modes: count out of range; got 2.5; give a whole number"),
        (lambda: _response(load=MODEL.load[:-1]), "frequency response: the load has the wrong shape"),
        (lambda: _response(load=np.full(MODEL.n_dof, NAN)), "frequency response: the load is not finite"),
        (lambda: _response(sensors=np.zeros((1, 3))), "frequency response: the table of sensors has the wrong shape"),
        (lambda: _response(sensors=np.zeros(MODEL.n_dof)), "give rows of .* numbers, as sensor_rows does"),
        (lambda: _response(frequency_hz=100.0), "the list of frequencies has the wrong shape; .* a list of frequenc"),
        (lambda: _response(frequency_hz=[NAN]), "the list of frequencies is not finite"),
        (lambda: fem.mac(np.ones((3, 1)), np.ones((4, 1))), "mac: the sets of shapes do not fit together"),
        (lambda: fem.mac(np.ones(3), np.ones((3, 1))), "mac: the sets of shapes do not fit together"),
        (lambda: fem.solve_modes(MODEL, REST, int(MODEL.free.sum())), "modes: count out of range"),
        (lambda: fem.rayleigh(_modes(), (0, 0), (0.01, 0.01)), "two different modes are needed"),
        (lambda: fem.rayleigh(_modes(), (0, 3), (0.01, 0.01)), "no such mode; .* modes are 0 to 2"),
        (lambda: fem.rayleigh(_modes(), (0, 1), (0.01,)), "the pair of ratios has the wrong shape"),
        (lambda: fem.point_stress(MODEL, REST.u, (0.1, 0.1, 0.05)), r"one point as \[\(x, y, z\)\]"),
        (lambda: fem.nodal_stress(MODEL, REST.u[:-1]), "stress: the displacement has the wrong shape"),
        (lambda: fem.integration_point_stress(MODEL, REST.u, "plate"), "unknown body; got plate; bodies are beam"),
        (lambda: fem.lock_bolts(MODEL, np.ones(2)), "bolts: the shortening has the wrong shape"),
        (lambda: fem.reaction_moment(MODEL, REST, "beam.x_min", (0.0, 0.0)), "the point has the wrong shape"),
    ],
)
def test_statics_modes_and_results(make: Callable[[], object], message: str) -> None:
    with pytest.raises(fem.FemInputError, match=message):
        make()


@pytest.mark.parametrize("make", [_transient, _explicit])
@pytest.mark.parametrize(
    ("displacement", "velocity", "message"),
    [
        (ZERO[:-3], ZERO, "the displacement has the wrong shape"),
        (ZERO[:, 0], ZERO, "the displacement has the wrong shape.*one column for each case"),
        (ZERO, np.hstack([ZERO, ZERO]), "the velocity has the wrong shape"),
        (ZERO, 0.0, "the velocity has the wrong shape"),
        (ZERO + NAN, ZERO, "the displacement is not finite"),
        (ZERO, ZERO + INF, "the velocity is not finite"),
    ],
)
def test_starts_of_motions(
    make: Callable[[], fem.Transient], displacement: object, velocity: object, message: str
) -> None:
    with pytest.raises(fem.FemInputError, match=f"start of the motion: {message}"):
        make().start(displacement, velocity)


@pytest.mark.parametrize("make", [_transient, _explicit])
def test_loads_that_follow_no_time(make: Callable[..., object]) -> None:
    with pytest.raises(fem.FemInputError, match="not a TimeLoad; got Force; make it with time_load"):
        make(loads=[LOAD])


def test_lists_and_text_paths_are_taken(tmp_path: Path) -> None:
    block = fem.hex_block([0.0, 0.3], [0, 1], [0.0, 0.1])
    same = fem.Mesh(block.points.tolist(), block.cells.tolist(), "hex20", {"end": block.surface("x_min").tolist()})
    np.testing.assert_array_equal(same.points, block.points)
    assert same.cells.dtype == np.int64
    model = single(same, supports=(fem.Support("body.end", ("x", "y", "z")),))
    fem.write_inp(str(tmp_path / "block.inp"), model)
    assert (tmp_path / "block.inp").read_text().startswith("*NODE")
    state = _explicit().start(ZERO.tolist(), ZERO.tolist())
    np.testing.assert_array_equal(state.u, ZERO)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: _moved((1.0, 2.0, 3.0)), "motion of beam.x_min: the vector has the wrong length; got 3; give one"),
        (lambda: _moved(2.0), "motion of beam.x_min: the vector has the wrong shape; .* each of the 2 directions"),
        (lambda: _moved((1.0, NAN)), "motion of beam.x_min: the vector is not finite"),
        (lambda: list(_transient().march(_transient().start(ZERO, ZERO), 2.5)), "n_step out of range; got 2.5"),
        (lambda: list(_explicit().march(_explicit().start(ZERO, ZERO), 2.5)), "n_step out of range; got 2.5"),
        (lambda: _recorded(2.5, np.zeros((1, MODEL.n_dof))), "history: n_step out of range; got 2.5"),
        (lambda: _recorded(2, np.zeros((1, 3))), "history: the table of sensors has the wrong shape"),
    ],
)
def test_motions(make: Callable[[], object], message: str) -> None:
    with pytest.raises(fem.FemInputError, match=message):
        make()


def test_one_factor_and_one_for_each_direction_are_taken() -> None:
    both, each = _moved((2.0,)), _moved((2.0, 3.0))
    held = 3 * MODEL.bodies[0].mesh.nodes("x_min")
    assert set(both.pattern[held]) == set(both.pattern[held + 1]) == set(each.pattern[held]) == {2.0}
    assert set(each.pattern[held + 1]) == {3.0}
