"""Proof that an exported unit computes what the Python model computes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.fmu.driver import Hold, fmpy_problems, replay
from romgen.fmu.records import FmuCheck, FmuReplay
from romgen.fmu.selection import exported_model
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from romgen.simulate import sensors, simulate

N_STEP = 2000
START_FRACTION = 0.5
"""Start of the free run and target of the forced runs, in trained amplitudes."""

SEED = 20140801

STILL_FRACTION = 1e-6
"""Share of the largest motion below which a state or sensor counts as standing still."""


def check_fmu(
    native: Path | str,
    model: ReducedModel,
    settings: FmuSettings,
    *,
    pythonfmu: Path | str | None = None,
    n_step: int = N_STEP,
    z0: ComplexArray | None = None,
) -> FmuCheck:
    """Measure how far exported units are from the Python model under the same input treatment, through fmpy.

    The algorithms are equal, so round-off (1e-12 or less) is expected.
    Runs: free from a start state; from rest under random sines held in each step; the same linear in each step (native
    only, pythonfmu units have no input derivatives).

    Parameters
    ----------
    native, pythonfmu : the units; the second is optional.
    model, settings : what they were exported from.
    n_step : communication steps of each run.
    z0 : (m,) start state of the free run, default half the trained amplitudes.

    Raises
    ------
    InputError, NumericalError : when a unit has no binary for this machine, or fails on the way.
    """
    chosen = exported_model(model, settings.sensors)
    t: FloatArray = settings.step_size * np.arange(n_step + 1, dtype=np.float64)
    start = START_FRACTION * chosen.trained_amplitude.astype(np.complex128) if z0 is None else z0
    rest, u = np.zeros_like(start), random_input(chosen, t)
    free = difference(native, chosen, t, start)
    held = difference(native, chosen, t, rest, u)
    linear = difference(native, chosen, t, rest, u, hold="linear")
    python_problems: tuple[str, ...] = ()
    python_rel = None
    if pythonfmu is not None:
        python_problems = fmpy_problems(pythonfmu)
        python_rel = max(difference(pythonfmu, chosen, t, start), difference(pythonfmu, chosen, t, rest, u))
    worst, problems = max(free, held, linear), fmpy_problems(native)
    return FmuCheck(problems, worst, free, held, linear, python_problems, python_rel, settings.step_size, n_step)


def difference(
    path: Path | str,
    model: ReducedModel,
    t: FloatArray,
    z0: ComplexArray,
    u: FloatArray | None = None,
    *,
    hold: Hold = "constant",
) -> float:
    """Largest difference of a unit from ``romgen.simulate``, each quantity relative to its largest magnitude.

    Parameters
    ----------
    path : the unit, exported from ``model``.
    t : (n_time,) s.
    z0 : (m,) start state.
    u : (n_time, n_input) or None.
    hold : input treatment of both.
    """
    run = replay(path, t, z0, u, hold=hold)
    z = simulate(model, t, z0, u, hold=hold)
    return replay_difference(run, model, z)


def replay_difference(run: FmuReplay, model: ReducedModel, z: ComplexArray) -> float:
    """Largest relative difference of a replay from states z (n_time, m) and their sensors."""
    displacement, velocity = sensors(model, z)
    state = np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)
    pairs = ((run.state, state), (run.displacement, displacement), (run.velocity, velocity))
    return max(_relative(a, b) for a, b in pairs)


def random_input(model: ReducedModel, t: FloatArray) -> FloatArray:
    """(n_time, n_input) repeatable sums of sines up to 1.5 times the highest frequency.

    Scaled so that a resonant sine of the same root mean square would drive the mode to half its trained amplitude
    within the run: |G u| t_end = |z|.
    """
    rng = np.random.default_rng(SEED)
    f_max = float(np.max(model.eigenvalues.imag)) / (2.0 * np.pi)
    frequency = rng.uniform(0.1 * f_max, 1.5 * f_max, (20, len(model.inputs)))
    phase = rng.uniform(0.0, 2.0 * np.pi, frequency.shape)
    wave = np.sin(2.0 * np.pi * frequency * t[:, None, None] + phase).sum(axis=1) / np.sqrt(len(frequency))
    effect = np.abs(model.input_matrix) * (t[-1] - t[0]) / model.trained_amplitude[:, None]
    strongest = np.maximum(np.max(effect, axis=0), np.finfo(float).tiny)
    u: FloatArray = START_FRACTION * wave / strongest
    return u


def _relative(actual: FloatArray, expected: FloatArray) -> float:
    """Largest over the columns of max |actual - expected| / max |expected|.

    A column that moves less than 1e-6 of the largest one counts relative to that: it is round-off of the others.
    """
    error = np.max(np.abs(actual - expected), axis=0)
    size = np.max(np.abs(expected), axis=0)
    floor = max(STILL_FRACTION * float(np.max(size)), np.finfo(float).tiny)
    return float(np.max(error / np.maximum(size, floor)))
