"""A co-simulation loop in Python with rollback: both sides of each step are iterated until they agree.

Without iteration the feedback acts one step late; here the state before the step is restored (fmi2SetFMUstate) and the
step is repeated with an input that is linear between its old value and the latest guess of the new one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.fmu.driver import opened_slave

Law = Callable[[float, float], float]
"""Acceleration of the base from time and measured velocity."""


def coupled(unit: Path, z0: ComplexArray, law: Law, grid: tuple[float, int], iterations: int = 20) -> FloatArray:
    """Run a unit with its first sensor's velocity fed back to its first input.

    Parameters
    ----------
    unit : exported by romgen, one input.
    z0 : (m,) start state.
    law : the other side of the loop.
    grid : communication step in s, number of steps.
    iterations : per step at most; 0 leaves the feedback one step late and held.

    Returns
    -------
    (n_step + 1, 2m) re z_1, im z_1, re z_2, ...
    """
    step, n_step = grid
    with opened_slave(unit) as slave:
        fmu, vr = slave.fmu, slave.references
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal(vr.states, np.stack([z0.real, z0.imag], axis=-1).ravel().tolist())
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        load, sensor = [vr.inputs[0]], [vr.velocity[0]]
        rows = [fmu.getReal(vr.states)]
        before = law(0.0, fmu.getReal(sensor)[0])
        state = fmu.getFMUstate()
        for k in range(n_step):
            t, after = k * step, before
            fmu.fmi2GetFMUstate(fmu.component, state)  # overwritten, so that nothing piles up
            for j in range(max(iterations, 1)):
                if j:
                    fmu.setFMUstate(state)
                fmu.setReal(load, [before])
                if iterations:
                    fmu.setRealInputDerivatives(load, [1], [(after - before) / step])
                fmu.doStep(t, step)
                guess, after = after, law(t + step, fmu.getReal(sensor)[0])
                if abs(after - guess) <= 1e-12 * max(abs(after), 1e-30):
                    break
            rows.append(fmu.getReal(vr.states))
            before = after
        fmu.freeFMUstate(state)
        return np.array(rows)
