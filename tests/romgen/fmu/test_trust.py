"""What a unit says outside the trained range, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from romgen.errors import NumericalError
from romgen.fmu.driver import Slave, opened_slave, replay
from romgen.fmu.interface import build_interface
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel

H = 1e-4


def reference(model: ReducedModel, name: str) -> int:
    return next(v.reference for v in build_interface(model).variables if v.name == name)


def test_one_message_for_each_crossing(slave: Slave, model: ReducedModel) -> None:
    """A decaying motion that starts outside: one message on leaving, one on coming back."""
    fmu = slave.fmu
    fmu.setReal([reference(model, "z1_re")], [1.02 * model.trained_amplitude[0]])
    fmu.exitInitializationMode()
    inside = [fmu.getBoolean([0])[0]]
    for k in range(200):
        fmu.doStep(k * H, H)
        inside.append(fmu.getBoolean([0])[0])
    assert inside[0] == 0
    assert inside[-1] == 1
    left, back = slave.messages
    assert "left the trained range" in left
    assert "back in the trained range" in back
    crossing = float(back.split("from t = ")[1].split()[0])
    assert crossing == pytest.approx(H * inside.index(1), rel=1e-6)


def test_trust_ratio_is_the_distance_of_the_trained_range(slave: Slave, model: ReducedModel) -> None:
    """The facets of the model: abs(z_1) <= 1, 0.7 abs(z_1) + 0.8 abs(z_2) <= 1, abs(z_2) <= 0.8."""
    fmu = slave.fmu
    for states, expected in (
        ([0.3, 0.4, 0.0, -0.6], 0.35 + 0.48),
        ([0.6, -0.8, 0.0, 0.1], 1.0),
        ([0.0, 0.1, 0.6, 0.0], 0.75),
    ):
        fmu.setReal(slave.references.states, states)
        assert fmu.getReal([slave.references.trust_ratio])[0] == pytest.approx(expected, rel=1e-15)
        z = np.array([[complex(*states[:2]), complex(*states[2:])]])
        assert model.trained_range.distance(z)[0] == pytest.approx(expected, rel=1e-15)
    fmu.setReal(slave.references.states, [0.3, 0.4, 0.0, -0.6])
    amplitudes = [reference(model, f"modal_amplitude_{j}") for j in (1, 2)]
    np.testing.assert_allclose(fmu.getReal(amplitudes), [0.5, 0.6], rtol=1e-15)


def test_hard_limit_fails_and_keeps_the_state(slave: Slave, model: ReducedModel) -> None:
    fmu, vr = slave.fmu, slave.references
    fmu.setReal([reference(model, "hard_limit"), vr.states[0]], [0.5, 0.3])
    fmu.exitInitializationMode()
    for k in range(3):
        fmu.doStep(k * H, H)
    before = fmu.getReal(vr.states)
    fmu.setReal(vr.inputs, [1e6, 0.0])
    with pytest.raises(FMICallException, match="fmi2DoStep failed with status 3"):
        fmu.doStep(3 * H, 10 * H)
    assert fmu.getReal(vr.states) == before
    assert fmu.getRealStatus(2) == pytest.approx(3 * H, rel=1e-15)
    assert "hard_limit" in slave.messages[-1]


def test_replay_names_the_reason_of_a_failure(native: FmuExport, model: ReducedModel) -> None:
    t = H * np.arange(100)
    with pytest.raises(NumericalError, match="hard_limit"):
        replay(native.path, t, np.zeros(2, dtype=complex), np.full((100, 2), 1e6))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_bad_input_value_is_refused_and_nothing_set(slave: Slave, bad: float) -> None:
    vr = slave.references.inputs
    slave.fmu.setReal(vr, [1.0, 2.0])
    with pytest.raises(FMICallException, match="fmi2SetReal"):
        slave.fmu.setReal(vr, [5.0, bad])
    assert slave.fmu.getReal(vr) == [1.0, 2.0]


def test_setting_an_input_resets_its_slope_and_a_step_carries_it_on(native: FmuExport, model: ReducedModel) -> None:
    with opened_slave(native.path) as slave:
        fmu, vr = slave.fmu, slave.references.inputs
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.setReal(vr, [1.0, 2.0])
        fmu.setRealInputDerivatives(vr, [1, 1], [1e4, 0.0])
        fmu.doStep(0.0, H)
        fmu.doStep(H, H)
        assert fmu.getReal(vr) == [3.0, 2.0]
        fmu.setReal(vr, [1.0, 2.0])
        fmu.doStep(2 * H, H)
        assert fmu.getReal(vr) == [1.0, 2.0]
