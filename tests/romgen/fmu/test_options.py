"""Outputs and start values that are chosen at export: absolute motion, phases, a start from the sensors."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.fmu.driver import Slave, fmpy_problems, opened_slave
from romgen.fmu.export import export_fmu
from romgen.fmu.interface import build_interface
from romgen.fmu.magnitudes import nominal_displacement, nominal_velocity
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuInfo, InterfaceOptions
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from romgen.simulate import sensors

H = 1e-4
SHARE = (1.0, 0.5, 0.0)
ABSOLUTE = InterfaceOptions((), SHARE, False)
STARTED = InterfaceOptions((), None, True)


def references(model: ReducedModel, options: InterfaceOptions) -> dict[str, int]:
    return {v.name: v.reference for v in build_interface(model, options).variables}


def values(slave: Slave, vr: dict[str, int], *names: str) -> FloatArray:
    return np.array(slave.fmu.getReal([vr[name] for name in names]))


X = ("lower_displacement", "mid_span_displacement", "upper_displacement")
V = ("lower_velocity", "mid_span_velocity", "upper_velocity")


@pytest.mark.parametrize("make", [export_fmu, export_pythonfmu])
def test_absolute_outputs_add_the_share_of_the_base(make, model: ReducedModel, tmp_path: Path) -> None:
    export = make(model, tmp_path / "x.fmu", FmuSettings(absolute=True), info=FmuInfo(base_share=SHARE))
    assert fmpy_problems(export.path) == ()
    vr = {v.name: k for k, v in enumerate(build_interface(model, ABSOLUTE).variables)}
    if make is export_fmu:
        vr = references(model, ABSOLUTE)
    with opened_slave(export.path) as slave:
        slave.fmu.setupExperiment(startTime=0.0)
        slave.fmu.setReal(slave.references.states, [0.3, 0.2, -0.1, 0.4])
        slave.fmu.enterInitializationMode()
        slave.fmu.setReal([vr["base_displacement"], vr["base_velocity"], vr["input_gain"]], [2e-3, 0.7, 2.0])
        for names, motion in ((X, 4e-3), (V, 1.4)):
            moved = values(slave, vr, *(name + "_absolute" for name in names)) - values(slave, vr, *names)
            np.testing.assert_allclose(moved, motion * np.array(SHARE), rtol=1e-14, atol=1e-16)
        rest = [f"der_z{j}_{part}" for j in (1, 2) for part in ("re", "im")]
        before = values(slave, vr, *rest)
        slave.fmu.setReal([vr["base_displacement"], vr["base_velocity"]], [0.0, 0.0])
        np.testing.assert_array_equal(values(slave, vr, *rest), before)  # the motion of the base drives nothing


def test_absolute_outputs_have_the_derivatives_of_the_base(model: ReducedModel, tmp_path: Path) -> None:
    """Along the inputs, along the gain, and in time with the slope of the inputs."""
    export_fmu(model, tmp_path / "x.fmu", FmuSettings(absolute=True), info=FmuInfo(base_share=SHARE))
    vr = references(model, ABSOLUTE)
    out = [vr[name + "_absolute"] for name in X]
    base = vr["base_displacement"]
    with opened_slave(tmp_path / "x.fmu") as slave:
        fmu = slave.fmu
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.setReal([vr["input_gain"], base], [2.0, 3e-3])
        assert fmu.getDirectionalDerivative(out, [base], [1.0]) == [2.0, 1.0, 0.0]
        np.testing.assert_allclose(
            fmu.getDirectionalDerivative(out, [vr["input_gain"]], [1.0]), [3e-3, 1.5e-3, 0.0], rtol=1e-15
        )
        fmu.setRealInputDerivatives([base], [1], [5.0])
        assert fmu.getRealOutputDerivatives(out, [1, 1, 1]) == [10.0, 5.0, 0.0]
        fmu.doStep(0.0, H)
        np.testing.assert_allclose(fmu.getReal(out), [2.0 * 3.5e-3, 3.5e-3, 0.0], rtol=1e-12, atol=1e-15)


def test_declared_dependencies_of_absolute_outputs(model: ReducedModel) -> None:
    interface = build_interface(model, ABSOLUTE)
    outputs = {u.index: u.dependencies for u in interface.outputs}
    index = interface.index
    assert index("base_displacement") in outputs[index("lower_displacement_absolute")]
    assert index("base_velocity") in outputs[index("mid_span_velocity_absolute")]
    assert index("base_displacement") not in outputs[index("upper_displacement_absolute")]
    initial = {u.index: u.dependencies for u in interface.initial_unknowns}
    assert index("input_gain") in initial[index("lower_displacement_absolute")]


def test_absolute_outputs_need_motion_of_the_base(model: ReducedModel, tmp_path: Path) -> None:
    free = dataclasses.replace(model, inputs=("force", "shaker force"))
    with pytest.raises(InputError, match="motion of the base"):
        export_fmu(free, tmp_path / "x.fmu", FmuSettings(absolute=True, platforms=()))
    with pytest.raises(InputError, match="one share per sensor"):
        export_fmu(model, tmp_path / "x.fmu", FmuSettings(absolute=True, platforms=()), info=FmuInfo(base_share=(1.0,)))


def test_phases_are_the_angles_of_the_states(slave: Slave, model: ReducedModel) -> None:
    vr = references(model, InterfaceOptions())
    assert values(slave, vr, "modal_phase_1", "modal_phase_2").tolist() == [0.0, 0.0]
    z = np.array([0.3 - 0.4j, -0.2 + 0.1j])
    slave.fmu.setReal(slave.references.states, np.stack([z.real, z.imag], axis=-1).ravel().tolist())
    phases = [vr["modal_phase_1"], vr["modal_phase_2"]]
    np.testing.assert_allclose(slave.fmu.getReal(phases), np.angle(z), rtol=1e-15)
    dz = np.array([0.7 + 0.2j, -0.3 + 0.5j])
    seed = np.stack([dz.real, dz.imag], axis=-1).ravel().tolist()
    slope = slave.fmu.getDirectionalDerivative(phases, list(slave.references.states), seed)
    h = 1e-6
    difference = (np.angle(z + h * dz) - np.angle(z - h * dz)) / (2.0 * h)
    np.testing.assert_allclose(slope, difference, rtol=1e-8)  # rounding eps / h = 2e-10 of angles of order 1


@pytest.fixture(scope="module")
def from_sensors(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A unit that starts from its sensors."""
    path = tmp_path_factory.mktemp("started") / "x.fmu"
    export_fmu(model, path, FmuSettings(start="sensors"))
    assert fmpy_problems(path) == ()
    return path


def start(slave: Slave, model: ReducedModel, x: FloatArray, v: FloatArray) -> tuple[FloatArray, float]:
    """States and misfit after initialisation from displacements and velocities."""
    vr = references(model, STARTED)
    names = [f"start_{name}" for name in (*X, *V)]
    slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.setReal([vr[name] for name in names], [*x, *v])
    slave.fmu.enterInitializationMode()
    state = np.array(slave.fmu.getReal(slave.references.states))
    (misfit,) = values(slave, vr, "start_misfit")
    slave.fmu.exitInitializationMode()
    return state, float(misfit)


def test_a_motion_of_the_model_is_found_again(from_sensors: Path, model: ReducedModel) -> None:
    """Six sensor values of a state determine its four coordinates."""
    z = np.array([[0.25 + 0.1j, -0.1 + 0.15j]])
    x, v = (a[0] for a in sensors(model, z))
    with opened_slave(from_sensors) as slave:
        state, misfit = start(slave, model, x, v)
    np.testing.assert_allclose(state, [0.25, 0.1, -0.1, 0.15], atol=1e-9)
    assert misfit < 1e-9


def test_a_shape_the_model_cannot_show_gets_its_best_fit(from_sensors: Path, model: ReducedModel) -> None:
    """Against scipy's least squares of the same weighted misfit."""
    x, v = np.array([2e-4, -1e-4, 3e-4]), np.zeros(3)
    size = np.repeat([nominal_displacement(model).max(), nominal_velocity(model).max()], 3)

    def misfit(w: FloatArray) -> FloatArray:
        z = (w[0::2] + 1j * w[1::2])[None]
        return (np.concatenate([a[0] for a in sensors(model, z)]) - np.concatenate([x, v])) / size

    best = least_squares(misfit, np.zeros(4), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    with opened_slave(from_sensors) as slave:
        state, left = start(slave, model, x, v)
    np.testing.assert_allclose(state, best.x, atol=1e-6)  # least squares to rounding of its cost: sqrt(eps) of a state
    wanted = np.linalg.norm(np.concatenate([x, v]) / size)
    assert left == pytest.approx(np.linalg.norm(best.fun) / wanted, rel=1e-6)


def test_rest_is_rest_and_states_are_not_set_by_hand(from_sensors: Path, model: ReducedModel) -> None:
    with opened_slave(from_sensors) as slave:
        state, misfit = start(slave, model, np.zeros(3), np.zeros(3))
    assert state.tolist() == [0.0] * 4
    assert misfit == 0.0
    interface = build_interface(model, STARTED)
    calculated = [k for k, v in enumerate(interface.variables, 1) if v.initial == "calculated"]
    assert [u.index for u in interface.initial_unknowns] == calculated
