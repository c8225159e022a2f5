"""The validation levels L0 to L3 of a unit from its file alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description, simulate_fmu

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.fmu.binary_checks import binary_rows, host_library, load_problem
from romgen.fmu.check import random_input, replay_difference
from romgen.fmu.driver import Hold, fmpy_problems, replay, unpacked
from romgen.fmu.driver3 import float_lengths
from romgen.fmu.kernel_checks import START, kernel_rows
from romgen.fmu.model_exchange import replay_model_exchange
from romgen.fmu.model_file import model_in_unit
from romgen.fmu.records import FmuLevels, LevelRow
from romgen.fmu.rules import rule_problems
from romgen.fmu.sensor_variables import BASE_MOTION
from romgen.fmu.state_checks import state_rows
from romgen.fmu.unit_facts import unit_facts
from romgen.progress import Report
from romgen.reduced_model import ReducedModel
from romgen.simulate import simulate_reference

NOT_MEASURED = (
    "L1 to L3 need a native unit of romgen that starts from states, with a default step and a working binary for "
    "this machine"
)
NOT_HERE = "valgrind, sanitizers and random call sequences run in the tests of romgen, not in this table"


def _silent(fraction: float, text: str) -> None:
    """Report nothing."""


def validate_unit(path: Path, report: Report = _silent) -> FmuLevels:
    """Check a unit from its file alone: structure for any unit of FMI 2.0 or 3.0, all levels for one of romgen.

    The Python model is read from resources/rom.json in the unit. Levels are L0 structure and binary, L1 equations and
    integrator, L2 states and use, L3 importers and treatment of inputs.

    Parameters
    ----------
    path : the unit.
    report : told the finished fraction and the level in work.

    Raises
    ------
    InputError : the file is no unit, or its model cannot be read.
    """
    report(0.0, "L0")
    broken, version = rule_problems(path), unit_facts(path).fmi_version
    problems = fmpy_problems(path)
    rows = [
        LevelRow("L0", "problems that fmpy's validator reports", len(problems), 0.0, 0.0),
        LevelRow("L0", f"rules of FMI {version} that are broken", len(broken), 0.0, 0.0),
    ]
    found, notes = (*problems, *broken), [NOT_HERE]
    model = model_in_unit(path)
    with unpacked(path) as folder:
        library = host_library(Path(folder), version)
        damage = None if library is None else load_problem(library)
        if damage is not None:
            rows.append(LevelRow("L0", "libraries for this machine that cannot be loaded", 1.0, 0.0, 0.0))
            found = (*found, damage)
        if model is not None and library is not None and damage is None and _is_native(path):
            _check_same_model(path, model)
            rows += binary_rows(library, version)
            rows += _measured(path, model, report)
        else:
            notes.insert(0, NOT_MEASURED)
    report(1.0, "checked")
    return FmuLevels(tuple(rows), found, tuple(notes))


def _check_same_model(path: Path, model: ReducedModel) -> None:
    """Whether the description and rom.json speak of the same states and inputs.

    Raises
    ------
    InputError : they do not.
    """
    lengths = float_lengths(_variables(path))  # of arrays, in FMI 3.0
    states = sum(lengths.get(v.valueReference, 1) for v in _variables(path) if v.derivative is not None)
    described, held = (states, len(_inputs(path))), (2 * len(model.eigenvalues), len(model.inputs))
    if described != held:
        raise InputError(
            "rom.json belongs to another unit",
            where=str(path),
            value=f"{held[0]} states and {held[1]} inputs, modelDescription.xml has {described[0]} and {described[1]}",
        )


def _measured(path: Path, model: ReducedModel, report: Report) -> Iterator[LevelRow]:
    step = float(read_model_description(str(path), validate=False).defaultExperiment.stepSize)
    report(0.1, "L1")
    yield from kernel_rows(path, model, step)
    report(0.5, "L2")
    yield from state_rows(path, model, step)
    report(0.8, "L3")
    yield from _input_rows(path, model, step)


def _is_native(path: Path) -> bool:
    """Both interfaces, start values of the states, and a step to take."""
    description = read_model_description(str(path), validate=False)
    if description.defaultExperiment is None or description.defaultExperiment.stepSize is None:
        return False
    states = [v.derivative for v in description.modelVariables if v.derivative is not None]
    both = description.coSimulation is not None and description.modelExchange is not None
    named = {v.name for v in description.modelVariables} >= {"trust_ratio", "max_internal_step"}
    return both and named and all(state.initial == "exact" for state in states)


def _input_rows(path: Path, model: ReducedModel, step: float) -> Iterator[LevelRow]:
    """fmpy's own Co-Simulation, Model Exchange with inputs at every stage, orders of the input treatment."""
    z0 = START * model.trained_amplitude.astype(np.complex128)
    t: FloatArray = step * np.arange(101, dtype=np.float64)
    if not model.inputs:
        return
    u = random_input(model, t)
    signals = np.array(
        [tuple(row) for row in np.column_stack([t, u])], dtype=[(n, float) for n in ("time", *_inputs(path))]
    )
    run = replay(path, t, np.zeros_like(z0), u)
    states = list(dict.fromkeys(v.derivative.name for v in _variables(path) if v.derivative is not None))
    simulated = simulate_fmu(
        str(path), validate=False, fmi_type="CoSimulation", stop_time=float(t[-1]), output_interval=step,
        input=signals, start_values={"warn_on_crossing": False}, logger=lambda *_: None, output=states,
    )  # fmt: skip
    rows = np.column_stack([simulated[name] for name in states])[: len(t)]
    apart = float(np.max(np.abs(rows - run.state[: len(rows)])) / np.max(np.abs(run.state)))
    yield LevelRow("L3", "fmpy's simulate_fmu against the step-by-step driver, held input", apart, 0.0, 1e-9)
    ramp = u[1] / t[-1]
    exchanged = replay_model_exchange(path, t[::10], z0, lambda time: ramp * time)
    z = simulate_reference(model, t[::10], z0, t[::10, None] * ramp, rtol=1e-12)
    yield LevelRow(
        "L3", "Model Exchange by DOP853, inputs at every stage", replay_difference(exchanged, model, z), 0.0, 1e-9
    )
    orders: tuple[tuple[Hold, float], ...] = (("constant", 1.0), ("linear", 2.0))
    for hold, order in orders:
        yield LevelRow("L3", f"order of the input error, {hold}", _input_order(path, model, hold), order, 0.1)


def _variables(path: Path) -> list[Any]:
    return list(read_model_description(str(path), validate=False).modelVariables)


def _inputs(path: Path) -> list[str]:
    base = {name for name, _ in BASE_MOTION}
    return [v.name for v in _variables(path) if v.causality == "input" and v.name not in base]


def _input_order(path: Path, model: ReducedModel, hold: Hold) -> float:
    """Slope of the end error of a smooth input over three communication steps against one 16 times finer."""
    slowest = float(np.min(np.abs(model.eigenvalues)))
    fastest = float(np.max(np.abs(model.eigenvalues)))
    end = 8.0 / slowest
    coarse = int(np.ceil(end * fastest / 0.1))

    def motion(n: int, treatment: Hold) -> FloatArray:
        t: FloatArray = np.linspace(0.0, end, n + 1)
        peak = np.max(np.abs(random_input(model, np.linspace(0.0, end, 65))), axis=0)
        u = np.sin(0.7 * slowest * t + 0.4)[:, None] * peak
        last: FloatArray = replay(path, t, np.zeros(len(model.eigenvalues), dtype=complex), u, hold=treatment).state[-1]
        return last

    counts = coarse * np.array([1, 2, 4])
    exact = motion(int(counts[-1]) * 16, "linear")
    errors = [np.max(np.abs(motion(int(n), hold) - exact)) for n in counts]
    return float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])
