"""L1: the equations and the integrator of a unit against the Python model."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.fmu.check import difference, random_input, replay_difference
from romgen.fmu.driver import Hold, opened_slave, replay
from romgen.fmu.records import LevelRow
from romgen.polynomial import evaluate, jacobian, zeta
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors, simulate_reference

N_STATE_CHECKED = 1000
START = 0.3
"""Start of the motions in trained amplitudes: well inside, so that no mixture of modes leaves the data."""

SMALL = 1e-6
"""Amplitude of the ring-down in trained ones: terms of degree two and more are below 1e-6 of the linear ones."""

PERIODS = 200


def kernel_rows(path: Path, model: ReducedModel, step: float) -> Iterator[LevelRow]:
    """State derivatives, outputs, Jacobian, trajectories, order of the integrator, ring-down.

    Parameters
    ----------
    path : the unit.
    model : what it was made from.
    step : s, communication step of the trajectories.
    """
    values, slopes = _kernel_errors(path, model)
    yield LevelRow(
        "L1", f"state derivatives and outputs, {N_STATE_CHECKED} random states, C against numpy", values, 0.0, 1e-13
    )
    yield LevelRow("L1", "directional derivatives against the analytic Jacobian", slopes, 0.0, 1e-10)
    t: FloatArray = step * np.arange(2001, dtype=np.float64)
    z0, rest = START * model.trained_amplitude.astype(np.complex128), np.zeros(len(model.eigenvalues), dtype=complex)
    u = random_input(model, t)
    yield LevelRow("L1", "free motion, 2,000 steps, same algorithm", difference(path, model, t, z0), 0.0, 1e-12)
    treatments: tuple[tuple[Hold, str], ...] = (("constant", "held"), ("linear", "linear in each step"))
    for hold, name in treatments:
        run = difference(path, model, t, rest, u, hold=hold)
        yield LevelRow("L1", f"forced, input {name}, 2,000 steps, same algorithm", run, 0.0, 1e-12)
        short = replay(path, t[:101], rest, u[:101], hold=hold)
        z = simulate_reference(model, t[:101], rest, u[:101], hold=hold, rtol=1e-12)
        yield LevelRow("L1", f"forced, input {name}, 100 steps, DOP853", replay_difference(short, model, z), 0.0, 1e-6)
    yield from _order_rows(path, model)
    yield from _ring_down_rows(path, model)


def random_states(model: ReducedModel, n: int) -> ComplexArray:
    """(n, m) repeatable states with every abs(z_j) below the trained one."""
    rng = np.random.default_rng(1)
    size = model.trained_amplitude * rng.uniform(0.0, 1.0, (n, len(model.eigenvalues)))
    z: ComplexArray = size * np.exp(2j * np.pi * rng.uniform(0.0, 1.0, size.shape))
    return z


def interleaved(z: ComplexArray) -> FloatArray:
    """(.., 2m) re z_1, im z_1, re z_2, ..."""
    x: FloatArray = np.stack([z.real, z.imag], axis=-1).reshape(*z.shape[:-1], -1)
    return x


def _kernel_errors(path: Path, model: ReducedModel) -> tuple[float, float]:
    """Largest error of z', x, x' over the largest value of each, and the same of the Jacobian of z'."""
    z = random_states(model, N_STATE_CHECKED)
    n = 2 * z.shape[1]
    rate = model.eigenvalues * z + evaluate(model.normal_form, zeta(z))
    expected = np.hstack([interleaved(rate), *sensors(model, z)])
    with opened_slave(path) as slave:
        fmu, vr = slave.fmu, slave.references
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        measured = []
        for x in interleaved(z):
            fmu.setReal(vr.states, x.tolist())
            measured.append(fmu.getReal([*vr.rates, *vr.displacement, *vr.velocity]))
        columns = [fmu.getDirectionalDerivative(vr.rates, [known], [1.0]) for known in vr.states]
    size = np.maximum(np.max(np.abs(expected), axis=0), np.finfo(float).tiny)
    values = float(np.max(np.max(np.abs(np.array(measured) - expected), axis=0) / size))
    m = n // 2
    J = jacobian(model.normal_form, zeta(z[-1:]))[0] if model.normal_form.exponents.size else np.zeros((m, n))
    linear = np.diag(model.eigenvalues)
    by_re, by_im = (
        linear + J[:, :m] + J[:, m:],
        1j * (linear + J[:, :m] - J[:, m:]),
    )
    exact = np.array([interleaved(by[:, j]) for j in range(m) for by in (by_re, by_im)])
    return values, float(np.max(np.abs(np.array(columns) - exact)) / np.max(np.abs(exact)))


def _order_rows(path: Path, model: ReducedModel) -> Iterator[LevelRow]:
    """Slope of the error over four internal steps, where it stands above rounding."""
    fastest = float(np.max(np.abs(model.eigenvalues)))
    steps = 2.0 / fastest / 2.0 ** np.arange(4)
    end = 16.0 * steps[0]
    exact = final_state(path, model, end, steps[0] / 256.0)
    errors = np.array([np.max(np.abs(final_state(path, model, end, h) - exact)) for h in steps]) / np.max(np.abs(exact))
    if errors[-1] > 1e-12:
        order = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
        yield LevelRow("L1", "order of the integrator over four internal steps", order, 4.0, 0.25)
    else:
        worst = float(errors[0])
        yield LevelRow("L1", "error at the longest internal step, too small to show an order", worst, 0.0, 1e-6)


def final_state(path: Path, model: ReducedModel, end: float, internal: float, n_step: int = 1) -> FloatArray:
    """State at ``end`` after ``n_step`` steps from START under a constant input, with a longest internal step in s."""
    u = random_input(model, np.linspace(0.0, end, 65))
    with opened_slave(path) as slave:
        fmu, vr = slave.fmu, slave.references
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal([vr.max_internal_step], [internal])
        fmu.setReal(vr.states, interleaved(START * model.trained_amplitude.astype(np.complex128)).tolist())
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        if vr.inputs:
            fmu.setReal(vr.inputs, np.max(np.abs(u), axis=0).tolist())
        for k in range(n_step):
            fmu.doStep(k * end / n_step, end / n_step)
        return np.array(fmu.getReal(vr.states))


def _ring_down_rows(path: Path, model: ReducedModel) -> Iterator[LevelRow]:
    """Frequency and damping of a small ring-down of each mode against its eigenvalue; the largest error."""
    errors = []
    for j, eigenvalue in enumerate(model.eigenvalues):
        z0 = np.zeros(len(model.eigenvalues), dtype=np.complex128)
        z0[j] = SMALL * model.trained_amplitude[j]
        period = 2.0 * np.pi / eigenvalue.imag
        t = 0.05 * period * np.arange(20 * PERIODS + 1)
        x = replay(path, t, z0).state[:, 2 * j : 2 * j + 2]
        z = np.log(np.abs(x[:, 0] + 1j * x[:, 1])), np.unwrap(np.angle(x[:, 0] + 1j * x[:, 1]))
        measured = complex(*((part[-1] - part[0]) / t[-1] for part in z))
        errors.append(abs(measured.imag / eigenvalue.imag - 1.0))
        errors.append(abs(measured.real / eigenvalue.real - 1.0))
    yield LevelRow("L1", f"small ring-down over {PERIODS} periods against the eigenvalue", max(errors), 0.0, 1e-8)
