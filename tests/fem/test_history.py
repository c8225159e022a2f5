"""Histories of transients, supports that move, and marches without a given scale of forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem.arrays import FloatArray
from fem.block import hex_block
from fem.campaign import Observation, march_campaign
from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.errors import FemInputError
from fem.excitation import support_motion, time_load
from fem.history import EnergyWarning, record_history, warn_of_imbalance
from fem.loads import Gravity, PointForce
from fem.material import Material
from fem.modal_quantities import frequency_response
from fem.model import Body, Model, Pair, Support, build_model
from fem.modes import ModalBasis, Rayleigh, damping_ratios, no_modes, rayleigh, rest_state, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.sensor import Sensor, sensor_rows
from fem.sliding import SlidingWarning
from fem.transient import Transient, TransientSettings
from tests.fem.small_models import STEEL, box, clamped_strip

TIP = (0.3, 0.005, 0.01)
SETTINGS = TransientSettings(2e-4, tolerance=1e-8)


def _cantilever(kinematics: str = "linear") -> tuple[Model, ModalBasis, FloatArray]:
    body = Body("beam", box((0.3, 0.01, 0.02), (5, 1, 1)), STEEL, kinematics)
    model = build_model([body], supports=[Support("beam.x_min", ("x", "y", "z"))])
    return model, solve_modes(model, rest_state(model), 4), sensor_rows(model, [Sensor("tip", TIP, "y")])


def _shake(t: float) -> float:
    """Displacement of the base, m: smooth, from rest."""
    return float(1e-3 * (1.0 - np.cos(2.0 * np.pi * 40.0 * t)))


def _shaken(model: Model, modes: ModalBasis, rows: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Tip relative to its base over 0.02 s: base led in space, and base acceleration in the moving frame."""
    settings, damping, omega = replace(SETTINGS, time_step=step), Rayleigh(0.0, 2e-5), 2.0 * np.pi * 40.0
    rest, still = rest_state(model), np.zeros((model.n_dof, 1))
    led = support_motion(model, "beam.x_min", ("y",), _shake)
    in_space = Transient(model, rest, modes, damping, settings, motions=[led])
    root = sensor_rows(model, [Sensor("root", (0.0, 0.005, 0.01), "y")])
    seen = record_history(in_space, in_space.start(still, still), round(0.02 / step), np.vstack([rows, root]))
    assert seen.displacement[:, 1, 0] == pytest.approx([_shake(t) for t in seen.t], abs=1e-15)
    # What the shaker gives is kinetic and strain energy and heat; the scheme damps by O(h^2), 0.2 % at 0.2 ms.
    assert np.abs(seen.imbalance).max() < 5e-3 * (step / 2e-4) ** 2 * np.abs(seen.external).max()
    moving = Transient(
        model, rest, modes, damping, settings, base_acceleration=lambda t: 1e-3 * omega**2 * np.cos(omega * t)
    )
    other = record_history(moving, moving.start(still, still), round(0.02 / step), rows)
    return seen.displacement[:, 0, 0] - seen.displacement[:, 1, 0], other.displacement[:, 0, 0]


@pytest.mark.parametrize("kinematics", ["linear", "green_lagrange"])
def test_moving_supports_equal_the_relative_motion_under_base_acceleration(kinematics: str) -> None:
    """A root led by u(t) in space minus u(t) = the motion under -M b u''(t), up to a difference of second order."""
    model, modes, rows = _cantilever(kinematics)
    errors = []
    for step in (4e-4, 2e-4):
        in_space, moving = _shaken(model, modes, rows, step)
        errors.append(np.abs(in_space - moving).max() / np.abs(moving).max())
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_ledger_of_moving_supports_closes_without_the_damping_of_the_scheme() -> None:
    """rho = 1 and an inertia that is not corrected: the ledger closes to the tolerance of the steps."""
    model, _, rows = _cantilever()
    rest = rest_state(model)
    led = support_motion(model, "beam.x_min", ("y",), _shake)
    settings = replace(SETTINGS, spectral_radius=1.0, dispersion_correction=False, tolerance=1e-10)
    march = Transient(model, rest, no_modes(model, rest), Rayleigh(0.0, 2e-5), settings, motions=[led])
    still = np.zeros((model.n_dof, 1))
    seen = record_history(march, march.start(still, still, settled=True), 100, rows)
    assert np.abs(seen.imbalance).max() < 1e-6 * np.abs(seen.external).max()


def test_march_with_moving_supports_goes_on_as_if_it_had_not_stopped() -> None:
    """Two halves equal the whole, bit by bit."""
    model, modes, rows = _cantilever()
    led = support_motion(model, "beam.x_min", ("y",), _shake)
    march = Transient(model, rest_state(model), modes, Rayleigh(0.0, 2e-5), SETTINGS, motions=[led])
    still = np.zeros((model.n_dof, 1))
    whole = record_history(march, march.start(still, still), 20, rows)
    first = record_history(march, march.start(still, still), 9, rows)
    second = record_history(march, first.state, 11, rows)
    assert np.array_equal(whole.state.u, second.state.u)
    assert second.t[0] == first.t[-1]


def test_only_held_components_move_and_only_from_zero() -> None:
    """Each message says what to do."""
    model, _, _ = _cantilever()
    with pytest.raises(FemInputError, match="only held components can be moved"):
        support_motion(model, "beam.x_max", ("y",), lambda t: t)
    with pytest.raises(FemInputError, match="unknown direction"):
        support_motion(model, "beam.x_min", ("w",), lambda t: t)
    with pytest.raises(FemInputError, match="does not start at 0"):
        support_motion(model, "beam.x_min", ("y",), lambda t: 1.0)
    both = support_motion(model, "beam.x_min", ("x", "y"), lambda t: t, vector=(1.0, -2.0))
    assert sorted(np.unique(both.pattern)) == [-2.0, 0.0, 1.0]


def test_scale_of_forces_need_not_be_given() -> None:
    """A strip with friction, pushed: the march without a scale follows the one with it within its tolerance."""
    model = clamped_strip()
    state = solve_static(model, model.load, StaticSettings(steps=2))
    modes = solve_modes(model, state, 2)
    damping = rayleigh(modes, (0, 1), (0.004, 0.004))
    push = time_load(model, PointForce("push", (0.0, 0.0, 0.01), (0.0, 5.0, 0.0)), lambda t: np.sin(2e3 * t))
    rows = sensor_rows(model, [Sensor("mid", (0.0, 0.0, 0.01), "y")])
    still = np.zeros((model.n_dof, 1))
    seen = []
    for scale in (None, 5.0):
        settings = TransientSettings(5e-5, tolerance=1e-6)
        march = Transient(model, state, modes, damping, settings, force_scale=scale, loads=[push])
        seen.append(record_history(march, march.start(still, still), 40, rows))
    peak = np.abs(seen[1].displacement).max()
    assert np.abs(seen[0].displacement - seen[1].displacement).max() < 1e-4 * peak
    assert seen[0].force.shape == (41, 2, 3, 1)
    # Both joints carry the clamping force, whatever the strip does.
    assert np.abs(seen[0].force[:, :, 1, 0]) == pytest.approx(np.full((41, 2), 4e3), rel=0.1)
    assert np.all(seen[0].slipping <= seen[0].closed)


def test_body_in_free_flight_needs_no_scale_either() -> None:
    """Nothing acts: no iterations and no drift."""
    model = build_model([Body("cube", box((0.1, 0.1, 0.1), (2, 2, 2)), STEEL)])
    rest = rest_state(model)
    settings = TransientSettings(1e-4, dispersion_correction=False)
    march = Transient(model, rest, no_modes(model, rest), Rayleigh(0.0, 0.0), settings)
    velocity = 10.0 * model.direction("x")[:, None]
    seen = record_history(
        march, march.start(0.0 * velocity, velocity), 10, model.direction("x")[None] / len(model.points)
    )
    assert seen.displacement[-1, 0, 0] == pytest.approx(1e-2, rel=1e-9)
    assert seen.kinetic[-1, 0] == pytest.approx(seen.kinetic[0, 0], rel=1e-9)


def test_explicit_march_has_a_history_too() -> None:
    """The same columns, from central differences, as the campaign keeps."""
    model, modes, rows = _cantilever()
    march = ExplicitTransient(model, rest_state(model), Rayleigh(0.0, 0.0), ExplicitSettings(2e-5))
    velocity = modes.shapes[:, :1]
    seen = record_history(march, march.start(0.0 * velocity, velocity), 10, rows)
    segments = list(
        march_campaign(march, Observation(modes, rows, 5), 10, 10, restart=march.start(0.0 * velocity, velocity))
    )
    assert np.array_equal(seen.displacement[1:], segments[0].displacement)
    assert np.abs(seen.imbalance).max() < 1e-2 * seen.kinetic[0, 0]


def test_frequency_response_is_that_of_the_mode() -> None:
    """At resonance |H| = S phi phi' p / (2 zeta omega^2) of that mode; far below, the static answer of the modes."""
    model, modes, rows = _cantilever()
    damping = rayleigh(modes, (0, 1), (0.01, 0.01))
    load = time_load(model, PointForce("tip", TIP, (0.0, 1.0, 0.0)), lambda t: 1.0).pattern
    hertz = modes.omega / (2.0 * np.pi)
    answer = frequency_response(modes, damping, load, rows, np.array([0.0, hertz[0]]))
    shares = (rows @ modes.shapes)[0] * (modes.shapes.T @ load) / modes.omega**2
    assert answer[0, 0] == pytest.approx(shares.sum())
    assert abs(answer[1, 0]) == pytest.approx(shares[0] / (2.0 * damping_ratios(modes, damping)[0]), rel=0.01)
    static = solve_static(model, load, StaticSettings(steps=1))
    assert answer[0, 0].real == pytest.approx(float((rows @ static.u)[0]), rel=0.05)


def test_energy_that_nothing_accounts_for_is_said() -> None:
    model, modes, rows = _cantilever()
    march = ExplicitTransient(model, rest_state(model), Rayleigh(0.0, 0.0), ExplicitSettings(2e-5))
    velocity = modes.shapes[:, :1]
    seen = record_history(march, march.start(0.0 * velocity, velocity), 10, rows)
    warn_of_imbalance(seen)
    half = np.where(np.arange(11)[:, None] < 6, 1.0, 1.5)
    with pytest.warns(EnergyWarning, match="case 0: the energies of the march do not add up") as caught:
        warn_of_imbalance(replace(seen, kinetic=half * seen.kinetic))
    assert f"from t = {seen.t[6]:.4g} s on" in str(caught[0].message)


def test_sliding_during_a_march_is_said() -> None:
    """A block at 2 m/s on a base whose facets are 0.1 m: after 10 ms it has slid by 20 mm, a tenth is 10 mm."""
    soft = Material(1e8, 0.0, 2000.0)
    base = hex_block(np.linspace(0.0, 0.3, 4), np.linspace(0.0, 0.1, 2), np.linspace(-0.05, 0.0, 2))
    block = hex_block(np.linspace(0.0, 0.1, 2), np.linspace(0.0, 0.1, 2), np.linspace(0.0, 0.1, 2))
    model = build_model(
        [Body("base", base, soft, "linear"), Body("block", block, soft, "linear")],
        pairs=[Pair("sole", "block.z_min", "base.z_max", 0.1)],
        supports=[Support("base.z_min", ("x", "y", "z"))],
        loads=[Gravity("weight", (0.0, 0.0, -9.81))],
    )
    rest = solve_static(model, model.load, StaticSettings(steps=1))
    march = Transient(model, rest, no_modes(model, rest), Rayleigh(0.0, 0.0), TransientSettings(1e-3))
    velocity = np.zeros((model.n_dof, 1))
    velocity[3 * model.offsets[1] :: 3] = 2.0
    with pytest.warns(SlidingWarning, match="contact sole: points slid by"):
        record_history(march, march.start(0.0 * velocity, velocity), 12, np.zeros((1, model.n_dof)))
