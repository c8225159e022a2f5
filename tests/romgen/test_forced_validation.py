"""Operating points, their lifted starts, and the comparison of both models."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.forced_curve import ForcedResponse
from romgen.forced_response import forced_response
from romgen.forced_validation import SETTLING, ForcedPoint, OperatingPoint, compare, forced_motion, operating_points
from romgen.manifold import Manifold
from romgen.reduced_model import ReducedModel
from romgen.settings import ForcedResponseSettings
from romgen.simulate import coordinates, sensors, simulate
from tests.normal_form_models import averaged_oscillator

LEVELS = (0.02, 0.05)


@pytest.fixture(scope="module")
def model() -> ReducedModel:
    return averaged_oscillator(1.5j, damping=0.01)


@pytest.fixture(scope="module")
def response(model: ReducedModel) -> ForcedResponse:
    settings = ForcedResponseSettings(input=model.inputs[0], levels=LEVELS, sensor=model.sensors[0])
    return forced_response(model, settings)


@pytest.fixture(scope="module")
def points(model: ReducedModel, response: ForcedResponse) -> tuple[OperatingPoint, ...]:
    return operating_points(model, response, (0.5, 0.9))


def run(model: ReducedModel, point: OperatingPoint, t: np.ndarray) -> np.ndarray:
    """The model from the point's state under its load, (n_time, m)."""
    u = point.level * np.cos(2.0 * np.pi * point.frequency_hz * t)[:, None]
    return simulate(model, t, point.z, u)


def test_points_lie_on_closed_orbits(model: ReducedModel, points: tuple[OperatingPoint, ...]) -> None:
    """After a period the state is back, up to what the settling time leaves of the transient."""
    assert [point.level for point in points] == [LEVELS[0]] * 2 + [LEVELS[1]] * 2
    for point in points:
        period = np.linspace(0.0, 1.0 / point.frequency_hz, 513)
        z = run(model, point, period)
        assert np.abs(z[-1] - z[0]).max() < np.exp(-SETTLING) * np.abs(z[0]).max()


def test_no_stable_point_inside_the_range(model: ReducedModel, response: ForcedResponse) -> None:
    empty = ForcedResponse(**{**vars(response), "curves": ()})
    with pytest.raises(InputError, match="no stable point"):
        operating_points(model, empty, (0.5,))


def test_lifted_start_moves_as_the_model_does(model: ReducedModel, points: tuple[OperatingPoint, ...]) -> None:
    """With the identity as manifold the start is y and y', y' by central differences of the simulated motion."""
    n = len(model.scale)
    manifold = Manifold(np.eye(n, dtype=np.int64), np.diag(model.scale), model.scale)
    motion = forced_motion(model, manifold, points, 7)
    h = 1e-4
    for case, point in enumerate(points):
        y = coordinates(model, run(model, point, np.array([0.0, h, 2.0 * h])))
        rate = (-3.0 * y[0] + 4.0 * y[1] - y[2]) / (2.0 * h)
        assert motion.displacement[:, case] == pytest.approx(y[0], rel=1e-9)
        # One-sided difference quotients: over 1e-7 s here, order 2 over 1e-4 s there.
        assert motion.velocity[:, case] == pytest.approx(rate, abs=1e-5 * np.abs(rate).max())
    (load,) = motion.loads.values()
    assert load(0.0) == pytest.approx([point.level for point in points])
    assert motion.n_step == 7


def test_the_model_agrees_with_itself(model: ReducedModel, points: tuple[OperatingPoint, ...]) -> None:
    """Fed with its own motion, scaled by 0.8, the comparison finds 25 % and no drift (linear interpolation: 1e-4)."""
    point, sensor = points[1], model.sensors[0]
    t = np.arange(0.0, 40.0 / point.frequency_hz, 0.002 / point.frequency_hz)
    x = sensors(model, run(model, point, t))[0][:, 0]
    found: ForcedPoint = compare(model, point, t, 0.8 * x, sensor, "sqrt2_rms")
    assert found.error_percent == pytest.approx(25.0, abs=0.02)
    assert abs(found.drift_percent) < 0.02
    assert found.rom_m == pytest.approx(np.sqrt(2.0) * np.sqrt(np.mean(x[-2500:] ** 2)), rel=1e-3)
