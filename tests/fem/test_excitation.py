"""Loads in time: every kind of dead load, per case, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.excitation import TimeLoad, base_load, time_load
from fem.loads import Clamp, PointForce
from fem.model import Model
from fem.modes import Rayleigh, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.supports import Support
from fem.transient import Transient, TransientSettings
from tests.fem.small_models import box, single


@pytest.fixture(scope="module")
def beam() -> Model:
    mesh = box((0.2, 0.01, 0.01), (3, 1, 1))
    return single(mesh, supports=(Support("body.x_min", ("x", "y", "z")),))


def _transient(beam: Model, loads: list[TimeLoad]) -> Transient:
    rest = solve_static(beam, beam.load, StaticSettings(steps=1, solver="superlu"))
    modes = solve_modes(beam, rest, 2, solver="superlu")
    damping = Rayleigh(2.0 * 0.7 * float(modes.omega[0]), 0.0)
    settings = TransientSettings(2e-4, 0.5, tolerance=1e-8, dispersion_correction=False, solver="superlu")
    return Transient(beam, rest, modes, damping, settings, force_scale=1.0, loads=loads)


def test_point_and_surface_loads_of_each_case_settle_at_their_static_states(beam: Model) -> None:
    """Ramps to 10 N at the tip in one case, to a pressure of 20 N in the other, and both times gravity of the base."""
    tip = time_load(beam, PointForce("tip", (0.2, 0.005, 0.005), (0.0, 1.0, 0.0)), lambda t: _ramp(t) * [10.0, 0.0])
    press = time_load(beam, Clamp("press", "body.y_max", 1.0), lambda t: _ramp(t) * [0.0, 20.0])
    shake = base_load(beam, "y", lambda t: 3.0 * _ramp(t))
    transient = _transient(beam, [tip, press, shake])
    zero = np.zeros((beam.n_dof, 2))
    *_, last = transient.march(transient.start(zero, zero), 150)
    for case, pattern in enumerate((10.0 * tip.pattern, 20.0 * press.pattern)):
        static = solve_static(beam, pattern + 3.0 * shake.pattern, StaticSettings(steps=1, solver="superlu")).u
        # 20 ms after the ramp the bending at 210 Hz with 70 % damping has decayed by exp(-0.7 * 1320 * 0.02) = 1e-8.
        np.testing.assert_allclose(last.state.u[:, case], static, atol=1e-6 * np.abs(static).max())


def _ramp(t: float) -> np.ndarray:
    return np.array([min(t / 0.01, 1.0)])


def test_loads_that_cannot_be_are_named(beam: Model) -> None:
    tip = PointForce("tip", (0.2, 0.005, 0.005), (0.0, 1.0, 0.0))
    zero = np.zeros((beam.n_dof, 2))
    late = _transient(beam, [time_load(beam, tip, lambda t: np.nan if t > 5e-4 else 1.0)])
    with pytest.raises(FemInputError, match=r"tip: load is not finite at t = 0.0006 s"):
        list(late.march(late.start(zero, zero), 5))
    many = _transient(beam, [time_load(beam, tip, lambda _: np.ones(3))])
    with pytest.raises(FemInputError, match="one for each of the 2 cases"):
        many.start(zero, zero)
    with pytest.raises(FemInputError, match="unknown direction"):
        base_load(beam, "sideways", lambda _: 0.0)


def test_work_of_a_load_that_comes_and_goes(beam: Model) -> None:
    """A harmonic tip force with rho = 1: stored + damped = given in every step, to the tolerance of the steps."""
    tip = PointForce("tip", (0.2, 0.005, 0.005), (0.0, 1.0, 0.0))
    load = time_load(beam, tip, lambda t: np.sin(2.0 * np.pi * 150.0 * t))
    linear = replace(beam, stiffness=beam.elastic_tangent(np.zeros(beam.n_dof)), nonlinear=())
    rest = solve_static(linear, linear.load, StaticSettings(steps=1, solver="superlu"))
    modes = solve_modes(linear, rest, 1, solver="superlu")
    settings = TransientSettings(2e-4, 1.0, tolerance=1e-9, dispersion_correction=False, solver="superlu")
    transient = Transient(linear, rest, modes, Rayleigh(20.0, 1e-6), settings, force_scale=1.0, loads=[load])
    zero = np.zeros((beam.n_dof, 1))
    records = list(transient.march(transient.start(zero, zero), 100))
    imbalance = [r.energies.sum() + r.state.work[:2].sum() - r.state.work[2].sum() for r in records]
    assert np.abs(imbalance).max() < 1e-8 * max(r.state.work[2, 0] for r in records)
