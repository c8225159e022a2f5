"""Model Exchange: an own driver that sets the inputs at every stage of an adaptive solver."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from fmpy.fmi2 import FMU2Model
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.fmu.check import replay_difference
from romgen.fmu.records import FmuExport, FmuReplay
from romgen.reduced_model import ReducedModel
from romgen.simulate import simulate_reference

N_STATE = 4
DOUBLES = ctypes.POINTER(ctypes.c_double)
FIRST_INPUT = 2 * N_STATE
SENSORS = range(FIRST_INPUT + 2, FIRST_INPUT + 8)


def test_dop853_through_the_interface_equals_the_python_model(
    native: FmuExport, unpacked: Path, model: ReducedModel
) -> None:
    """Both by DOP853 at 1e-12 with a linear input; the limit is that of two adaptive runs."""
    t = np.linspace(0.0, 0.01, 11)
    slope = np.array([3e3, -1e3])
    fmu = FMU2Model(guid=native.guid, modelIdentifier=model.name, unzipDirectory=str(unpacked))
    fmu.instantiate()
    x0 = [0.3, 0.1, 0.0, 0.4]
    fmu.setupExperiment(startTime=0.0)
    fmu.setReal(range(N_STATE), x0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.newDiscreteStates()
    fmu.enterContinuousTimeMode()
    buffer, rates = np.zeros(N_STATE), np.zeros(N_STATE)
    pointers = [a.ctypes.data_as(DOUBLES) for a in (buffer, rates)]

    def rate(time: float, x: FloatArray) -> FloatArray:
        buffer[:] = x
        fmu.setTime(time)
        fmu.setContinuousStates(pointers[0], N_STATE)
        fmu.setReal([FIRST_INPUT, FIRST_INPUT + 1], (slope * time).tolist())
        fmu.getDerivatives(pointers[1], N_STATE)
        return rates.copy()

    solution = solve_ivp(rate, (0.0, 0.01), x0, "DOP853", t, rtol=1e-12, atol=1e-13)
    outputs = []
    for x in solution.y.T:
        buffer[:] = x
        fmu.setContinuousStates(pointers[0], N_STATE)
        outputs.append(fmu.getReal(SENSORS))
    fmu.freeInstance()
    displacement, velocity = np.split(np.array(outputs), 2, axis=1)
    run = FmuReplay(t, solution.y.T, displacement, velocity, np.zeros(len(t)))
    z0 = np.array([0.3 + 0.1j, 0.4j])
    z = simulate_reference(model, t, z0, t[:, None] * slope, hold="linear", rtol=1e-12)
    assert replay_difference(run, model, z) <= 1e-9
