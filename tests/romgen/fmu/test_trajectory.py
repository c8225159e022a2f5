"""Motions of the native unit against the Python model, another integrator, and finer steps."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.arrays import FloatArray
from romgen.fmu.check import difference, replay_difference
from romgen.fmu.driver import opened_slave, replay
from romgen.fmu.interface import build_interface
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel
from romgen.simulate import simulate_reference
from tests.romgen.fmu.models import smooth_input

H = 1e-4
SAME_ALGORITHM = 1e-12
"""Round-off: 10,000 steps of about 1e-16 each, in a decaying motion."""


def start(model: ReducedModel) -> np.ndarray:
    return 0.6 * model.trained_amplitude * np.exp(1j * np.array([0.3, 2.0]))


def test_free_motion_over_ten_thousand_steps(native: FmuExport, model: ReducedModel) -> None:
    assert difference(native.path, model, H * np.arange(10001), start(model)) <= SAME_ALGORITHM


@pytest.mark.parametrize("hold", ["constant", "linear"])
def test_forced_motion_under_the_same_input(native: FmuExport, model: ReducedModel, hold: str) -> None:
    t = H * np.arange(2001)
    u = smooth_input(len(t), H, 2)
    assert difference(native.path, model, t, start(model), u, hold=hold) <= SAME_ALGORITHM


@pytest.mark.parametrize("hold", ["constant", "linear"])
def test_another_integrator_under_the_same_input(native: FmuExport, model: ReducedModel, hold: str) -> None:
    """DOP853 at 1e-12; the limit is the integrator error measured for ETDRK4 at 1e-4 s on such models."""
    t = H * np.arange(301)
    u = smooth_input(len(t), H, 2)
    run = replay(native.path, t, start(model), u, hold=hold)
    z = simulate_reference(model, t, start(model), u, hold=hold, rtol=1e-12)
    assert replay_difference(run, model, z) <= 1e-6


def final_state(native: FmuExport, model: ReducedModel, t: FloatArray, internal: float) -> FloatArray:
    """State at the end of a motion under a constant input with a chosen longest internal step."""
    reference = {v.name: v.reference for v in build_interface(model).variables if v.unit}
    z = start(model)
    with opened_slave(native.path) as slave:
        fmu = slave.fmu
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal([reference["max_internal_step"]], [internal])
        fmu.setReal(slave.references.states, np.stack([z.real, z.imag], axis=-1).ravel().tolist())
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.setReal(slave.references.inputs, [20.0, -10.0])
        for k in range(len(t) - 1):
            fmu.doStep(float(t[k]), float(t[k + 1] - t[k]))
        return np.array(fmu.getReal(slave.references.states))


def test_order_four_in_the_internal_step(native: FmuExport, model: ReducedModel) -> None:
    """Steps long enough that the error stands above round-off: 1.6e-3 to 2e-4 s."""
    t = np.array([0.0, 0.0256])
    steps = 1.6e-3 / 2.0 ** np.arange(4)
    exact = final_state(native, model, t, 1e-5)
    errors = [np.abs(final_state(native, model, t, h) - exact).max() for h in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.25)


def test_irregular_partition_of_a_constant_input(native: FmuExport, model: ReducedModel) -> None:
    """Short internal steps, so that only round-off and the integrator's own 1e-10 distinguish the partitions."""
    rng = np.random.default_rng(2)
    irregular = np.sort(np.concatenate([[0.0, 0.02], rng.uniform(0.0, 0.02, 60)]))
    regular = np.linspace(0.0, 0.02, 201)
    a, b = (final_state(native, model, t, 1e-5) for t in (irregular, regular))
    assert np.abs(a - b).max() <= 1e-9


@pytest.mark.parametrize(("hold", "order"), [("constant", 1.0), ("linear", 2.0)])
def test_order_of_the_input_treatment(native: FmuExport, model: ReducedModel, hold: str, order: float) -> None:
    """A smooth input sampled at three step sizes against a linear input at 64 times the finest."""
    end = 0.0128

    def motion(n: int, treatment: str) -> FloatArray:
        t = np.linspace(0.0, end, n + 1)
        u = smooth_input(n + 1, end / n, 2)
        return replay(native.path, t, start(model), u, hold=treatment).state[-1]

    counts = np.array([128, 256, 512])
    exact = motion(8192, "linear")
    errors = [np.abs(motion(int(n), hold) - exact).max() for n in counts]
    observed = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert observed == pytest.approx(order, abs=0.1)


def test_output_derivative_is_the_slope_of_the_output(native: FmuExport, model: ReducedModel) -> None:
    t = H * np.arange(21)
    h = 1e-6
    with opened_slave(native.path) as slave:
        fmu, vr = slave.fmu, slave.references
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal([vr.states[0]], [0.5])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        for k in range(len(t) - 1):
            fmu.doStep(float(t[k]), H)
        values, slopes = [], []
        for k in range(3):
            values.append(fmu.getReal(vr.displacement))
            slopes.append(fmu.getRealOutputDerivatives(vr.displacement, [1] * len(vr.displacement)))
            fmu.doStep(float(t[-1] + k * h), h)
    difference_quotient = (np.array(values[2]) - np.array(values[0])) / (2.0 * h)
    # Central difference: (omega h)^2 / 6 of the slope with its 5th harmonic, 8e-6.
    np.testing.assert_allclose(slopes[1], difference_quotient, rtol=1e-5, atol=1e-5 * np.abs(slopes[1]).max())
