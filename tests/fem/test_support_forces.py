"""Reactions of supports and forces of springs over time: momentum, exact modes, restarts, cases side by side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem.campaign import Observation, Starts, march_campaign
from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.errors import FemConvergenceError, FemInputError
from fem.excitation import support_motion, time_load
from fem.history import History, record_history
from fem.loads import Gravity, PointForce
from fem.material import Material
from fem.model import Body, Model, Pair, Spring, Support, build_model
from fem.modes import Rayleigh, no_modes, rest_state, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.reaction import reaction
from fem.transient import Transient, TransientSettings
from tests.fem.small_models import STEEL, box

PLAIN = Rayleigh(0.0, 0.0)


def _cantilever(kinematics: str = "linear") -> Model:
    body = Body("beam", box((0.3, 0.01, 0.02), (4, 1, 1)), STEEL, kinematics)
    return build_model([body], supports=[Support("beam.x_min", ("x", "y", "z"))])


def _no_sensor(model: Model) -> np.ndarray:
    return np.zeros((0, model.n_dof))


def _momentum(model: Model, v: np.ndarray, axis: str) -> float:
    return float(model.direction(axis) @ (model.mass @ v)[:, 0])


def _in_mode(step: float, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Base shear of a beam that swings in its first mode, computed and exact, R = (K - omega^2 M) phi cos(omega t)."""
    model = _cantilever()
    rest = rest_state(model)
    modes = solve_modes(model, rest, 1)
    settings = TransientSettings(step, radius, 1e-9, dispersion_correction=False)
    march = Transient(model, rest, modes, PLAIN, settings)
    shape = modes.shapes[:, :1]
    seen = record_history(march, march.start(shape, 0.0 * shape, settled=True), round(8e-3 / step), _no_sensor(model))
    held = (modes.stiffness @ shape - modes.omega**2 * (model.mass @ shape))[~model.free].reshape(-1, 3)[:, 1].sum()
    return seen.reaction[:, 0, 1, 0], held * np.cos(modes.omega[0] * seen.t)


@pytest.mark.parametrize("radius", [1.0, 0.9, 0.5])
def test_base_shear_of_a_mode_is_exact_to_second_order(radius: float) -> None:
    """The lag of the acceleration, of first order, is made up for; omega h = 0.07 and 0.035 at 91 Hz."""
    errors = []
    for step in (1.25e-4, 6.25e-5):
        seen, exact = _in_mode(step, radius)
        errors.append(np.abs(seen - exact).max() / np.abs(exact).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)


def test_reactions_balance_loads_and_inertia() -> None:
    """rho = 1 from equilibrium: M u'' + C u' + f - p = 0 in every output, so R = d/dt momentum - p + alpha momentum.

    Both hold to the residual of the steps, 1e-10 of the largest force, times the square root of 1,000 components.
    """
    model = _cantilever("green_lagrange")
    rest = rest_state(model)
    push = time_load(model, PointForce("push", (0.3, 0.005, 0.01), (0.0, 300.0, 40.0)), lambda t: 2e3 * t)
    settings = TransientSettings(5e-5, 1.0, 1e-10, dispersion_correction=False)
    march = Transient(model, rest, no_modes(model, rest), Rayleigh(20.0, 1e-6), settings, loads=[push])
    still = np.zeros((model.n_dof, 1))
    state, worst, largest = march.start(still, still, settled=True), 0.0, 0.0
    for record in march.march(state, 40):
        here = record.state
        for number, axis in enumerate("xyz"):
            b = model.direction(axis)
            given = float(push.pattern @ b) * 2e3 * here.step * 5e-5
            held = march.dynamics.support_force.resultants(record)[0, number, 0]
            miss = held + given - b @ (here.inertia_a + here.damping_v)[:, 0]
            worst, largest = max(worst, abs(miss)), max(largest, abs(held))
    assert largest > 100.0
    assert worst < 1e-10 * np.sqrt(1000.0) * largest


def test_shaken_base_carries_the_mass_that_it_moves() -> None:
    """A stiff beam under base acceleration a and one whose root moves so: R = mass a, up to (omega / omega_1)^2."""
    model = _cantilever()
    rest = rest_state(model)
    omega, mass = 2.0 * np.pi * 4.0, model.direction("y") @ model.mass @ model.direction("y")
    settings = TransientSettings(1e-3, tolerance=1e-8, dispersion_correction=False)
    wave = lambda t: 1e-3 * (1.0 - np.cos(omega * t))  # noqa: E731
    led = support_motion(model, "beam.x_min", ("y",), wave)
    still = np.zeros((model.n_dof, 1))
    damping = Rayleigh(0.0, 1e-3)
    in_space = Transient(model, rest, no_modes(model, rest), damping, settings, motions=[led])
    moving = Transient(
        model,
        rest,
        no_modes(model, rest),
        damping,
        settings,
        base_acceleration=lambda t: 1e-3 * omega**2 * np.cos(omega * t),
    )
    for march in (in_space, moving):
        seen = record_history(march, march.start(still, still), 250, _no_sensor(model))
        wanted = mass * 1e-3 * omega**2 * np.cos(omega * seen.t)
        # The start shakes the first mode (91 Hz), which beta damps within 0.02 s: twice (omega / omega_1)^2 = 4e-3.
        assert np.abs(seen.reaction[150:, 0, 1, 0] - wanted[150:]).max() < 2.0 * 4e-3 * wanted.max()


def _dropped() -> tuple[Model, ExplicitTransient]:
    """A block in free flight above a held base, with a soft spring between them."""
    soft = Material(1e7, 0.3, 1000.0)
    base = Body("base", box((0.1, 0.1, 0.1), (1, 1, 1)), soft, "linear")
    block = Body("block", box((0.1, 0.1, 0.1), (1, 1, 1), shift=0.1), soft, "linear")
    model = build_model(
        [base, block],
        pairs=[Pair("floor", "block.y_min", "base.y_max", 0.3)],
        supports=[Support("base.y_min", ("x", "y", "z")), Support("block.x_min", ("x",))],
        springs=[Spring("leash", (0.05, 0.2, 0.05), (0.0, 2e3, 100.0))],
        loads=[Gravity("weight", (0.0, -9.81, 0.0))],
    )
    rest = replace(rest_state(model))
    return model, ExplicitTransient(model, rest, PLAIN, ExplicitSettings(2e-5, 2e-5))


def test_impact_passes_its_momentum_to_supports_and_springs() -> None:
    """Central differences: the change of momentum is the trapezoidal sum of reactions, springs and weight."""
    model, march = _dropped()
    velocity = np.zeros((model.n_dof, 2))
    velocity[3 * model.offsets[1] + 1 :: 3] = -1.0, -0.5
    velocity[3 * model.offsets[1] + 2 :: 3] = 0.2
    seen = record_history(march, march.start(0.0 * velocity, velocity), 400, _no_sensor(model))
    assert seen.closed.max() > 0.0
    assert seen.reaction.shape == (401, 2, 3, 2)
    assert seen.spring.shape == (401, 1, 3, 2)
    lumped = march.model
    for axis, letter in enumerate("yz", 1):
        b = model.direction(letter)
        mass = lumped.mass.diagonal()
        weight = b @ model.load
        force = seen.reaction[:, :, axis].sum(axis=1) + seen.spring[:, 0, axis] + weight
        # The held nodes stay where they are: what their weight adds to the reaction moves nothing.
        impulse = 2e-5 * (0.5 * (force[1:] + force[:-1])).sum(axis=0)
        change = b @ (mass[:, None] * (seen.state.v - velocity * model.free[:, None]))
        np.testing.assert_allclose(change, impulse, atol=1e-11 * np.abs(impulse).max())


def test_at_rest_they_are_the_static_ones() -> None:
    """Two supports that share an edge: a shared component counts for the first, and all of them carry the load."""
    body = Body("beam", box((0.3, 0.01, 0.02), (4, 1, 1)), STEEL)
    model = build_model(
        [body],
        supports=[Support("beam.x_min", ("x", "y", "z")), Support("beam.z_min", ("z",))],
        springs=[Spring("prop", (0.3, 0.005, 0.01), (0.0, 1e5, 0.0))],
        loads=[Gravity("weight", (1.0, -9.81, 3.0))],
    )
    state = solve_static(model, model.load, StaticSettings(steps=1))
    march = Transient(model, state, no_modes(model, state), PLAIN, TransientSettings(1e-4))
    still = np.zeros((model.n_dof, 1))
    seen = record_history(march, march.start(still, still), 1, _no_sensor(model))
    load = model.load.reshape(-1, 3).sum(axis=0)
    for row in range(2):
        carried = seen.reaction[row].sum(axis=0) + seen.spring[row].sum(axis=0)
        assert carried[:, 0] == pytest.approx(-load, rel=1e-6)
        assert seen.reaction[row, 0, :, 0] == pytest.approx(reaction(model, state, "beam.x_min"), rel=1e-6)
        assert seen.spring[row, 0, :, 0] == pytest.approx(model.springs.forces(state.u)["prop"], rel=1e-6)


def test_marches_and_campaigns_go_on_as_if_they_had_not_stopped() -> None:
    """Two halves equal the whole bit by bit, two cases together; the campaign shows what the history shows."""
    model = _cantilever()
    rest = rest_state(model)
    modes = solve_modes(model, rest, 2)
    march = Transient(model, rest, modes, Rayleigh(0.0, 1e-6), TransientSettings(1e-4, tolerance=1e-8))
    starts = march.start(modes.shapes, np.zeros((model.n_dof, 2)))
    whole = record_history(march, starts, 12, _no_sensor(model))
    first = record_history(march, starts, 5, _no_sensor(model))
    second = record_history(march, first.state, 7, _no_sensor(model))
    np.testing.assert_array_equal(whole.reaction[6:], second.reaction[1:])
    np.testing.assert_array_equal(whole.reaction[:6], first.reaction)
    # The first row of the second half is made of the state alone: equal but for rounding of the rise of a.
    np.testing.assert_allclose(whole.reaction[5], second.reaction[0], atol=1e-12 * np.abs(whole.reaction).max())
    seen = Observation(modes, _no_sensor(model), 4)
    begin = Starts(modes.shapes, rest.contact.slip.repeat(2, axis=2))
    segments = list(march_campaign(march, seen, 12, 5, starts=begin))
    np.testing.assert_array_equal(np.concatenate([s.reaction for s in segments]), whole.reaction)
    assert segments[0].spring.shape == (6, 0, 3, 2)


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_outputs_inside_a_long_step_carry_them_too(share: float) -> None:
    """Adaptive steps, fewer than outputs: the same reactions within the error tolerance of the march."""
    model = _cantilever()
    rest = rest_state(model)
    modes = solve_modes(model, rest, 1)
    fine = TransientSettings(2e-5 / share, tolerance=1e-8, dispersion_correction=False)
    adaptive = replace(fine, time_step=2e-5, error_tolerance=1e-4, max_doublings=3)
    reactions = []
    for settings in (fine, adaptive):
        march = Transient(model, rest, modes, PLAIN, settings)
        shape = modes.shapes[:, :1]
        n = round(4e-3 / settings.time_step)
        seen = record_history(march, march.start(shape, 0.0 * shape, settled=True), n, _no_sensor(model))
        reactions.append(seen.reaction[:, 0, 1, 0])
    every = round(1.0 / share)
    # Period 11 ms, steps up to 0.16 ms: (omega h)^2 = 8e-3.
    assert np.abs(reactions[0] - reactions[1][::every]).max() < 8e-3 * np.abs(reactions[0]).max()


def test_failed_march_hands_on_its_history() -> None:
    """A load that breaks off after five steps, and a march that blows up: what was computed is in ``last_good``."""
    model = _cantilever()
    rest = rest_state(model)
    push = time_load(
        model, PointForce("push", (0.3, 0.005, 0.01), (0.0, 1.0, 0.0)), lambda t: 1.0 if t < 5.5e-4 else np.nan
    )
    march = Transient(model, rest, no_modes(model, rest), PLAIN, TransientSettings(1e-4), loads=[push])
    still = np.zeros((model.n_dof, 1))
    with pytest.raises(FemInputError, match="load is not finite") as caught:
        record_history(march, march.start(still, still), 10, _no_sensor(model))
    assert isinstance(caught.value.last_good, History)
    assert caught.value.last_good.t == pytest.approx(1e-4 * np.arange(6))
    hard = Transient(
        model, rest, no_modes(model, rest), PLAIN, replace(march.settings, max_iterations=1, tolerance=1e-15)
    )
    velocity = model.direction("y")[:, None]
    with pytest.raises(FemConvergenceError) as stopped:
        record_history(hard, hard.start(still, velocity), 3, _no_sensor(model))
    assert isinstance(stopped.value.last_good, History)


def test_springs_of_one_name_are_refused() -> None:
    body = Body("beam", box((0.3, 0.01, 0.02), (1, 1, 1)), STEEL)
    twice = [Spring("s", (x, 0.005, 0.01), (1e3, 1e3, 1e3)) for x in (0.0, 0.3)]
    with pytest.raises(FemInputError, match="springs of the same name; got s; give each a name of its own"):
        build_model([body], springs=twice)


def test_components_held_by_no_support_belong_to_none() -> None:
    """A model with more held by hand than its supports say: they keep what is theirs."""
    model = _cantilever()
    by_hand = replace(model, free=model.free & (np.arange(model.n_dof) % 3 != 2))
    rest = rest_state(by_hand)
    march = Transient(by_hand, rest, no_modes(by_hand, rest), PLAIN, TransientSettings(1e-4))
    velocity = by_hand.direction("y")[:, None] * by_hand.free[:, None]
    seen = record_history(march, march.start(0.0 * velocity, velocity), 2, _no_sensor(by_hand))
    assert seen.reaction.shape == (3, 1, 3, 1)
    assert np.all(seen.reaction[1:, 0, 1, 0] != 0.0)
