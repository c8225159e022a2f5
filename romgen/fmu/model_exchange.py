"""Model Exchange through fmpy with the inputs set at every stage of an adaptive solver."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from scipy.integrate import solve_ivp

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import NumericalError
from romgen.fmu.driver import References, collecting_callbacks, new_unit, references, unpacked
from romgen.fmu.records import FmuReplay

DOUBLES = ctypes.POINTER(ctypes.c_double)


def replay_model_exchange(
    path: Path | str,
    t: FloatArray,
    z0: ComplexArray,
    inputs: Callable[[float], FloatArray],
    *,
    rtol: float = 1e-12,
) -> FmuReplay:
    """Integrate a unit of FMI 2.0 or 3.0 by DOP853; time, states and inputs are set before each derivative is read.

    Importers that set inputs between solver calls only hold them there, an error of first order in the output interval;
    here u(t) is set at every stage.

    Parameters
    ----------
    path : the unit.
    t : (n_time,) s, increasing; where the states are kept.
    z0 : (m,) start state.
    inputs : u(t) -> (n_input,), SI units.
    rtol : relative tolerance of DOP853; the absolute one is a tenth of it.

    Raises
    ------
    NumericalError : when the solver stops.
    """
    with unpacked(path) as folder:
        description = read_model_description(folder, validate=False)
        fmu = new_unit(description, folder, "ModelExchange")
        fmu.instantiate(callbacks=collecting_callbacks([]))
        try:
            return _integrate(fmu, references(description.modelVariables), t, (z0, inputs), rtol)
        finally:
            fmu.freeInstance()


def _integrate(
    fmu: Any,
    vr: References,
    t: FloatArray,
    start: tuple[ComplexArray, Callable[[float], FloatArray]],
    rtol: float,
) -> FmuReplay:
    z0, inputs = start
    x0 = np.stack([z0.real, z0.imag], axis=-1).ravel()
    n = len(x0)
    fmu.setupExperiment(startTime=float(t[0]))
    fmu.setReal(vr.states, x0.tolist())
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.newDiscreteStates()
    fmu.enterContinuousTimeMode()
    state, rates = np.zeros(n), np.zeros(n)
    state_address, rates_address = (a.ctypes.data_as(DOUBLES) for a in (state, rates))

    def rate(time: float, x: FloatArray) -> FloatArray:
        state[:] = x
        fmu.setTime(time)
        fmu.setContinuousStates(state_address, n)
        if vr.inputs:
            fmu.setReal(vr.inputs, inputs(time).tolist())
        fmu.getDerivatives(rates_address, n)
        return rates.copy()

    solution = solve_ivp(rate, (float(t[0]), float(t[-1])), x0, "DOP853", t, rtol=rtol, atol=0.1 * rtol)
    if not solution.success:
        raise NumericalError("DOP853 stopped", where="Model Exchange", value=solution.message)
    read = (*vr.displacement, *vr.velocity, vr.trust_ratio)
    rows = []
    for x in solution.y.T:
        state[:] = x
        fmu.setContinuousStates(state_address, n)
        rows.append(fmu.getReal(read))
    displacement, velocity, trust = np.split(np.array(rows), [len(vr.displacement), len(read) - 1], axis=1)
    return FmuReplay(t, solution.y.T, displacement, velocity, trust[:, 0])
