"""The door to fmpy: validation, and driving a unit for Co-Simulation step by step."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.validation import validate_fmu

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError, NumericalError
from romgen.fmu.driver3 import Model3, Slave3, elements, float_lengths
from romgen.fmu.records import FmuReplay
from romgen.fmu.sensor_variables import BASE_MOTION

Hold = Literal["constant", "linear"]
Kind = Literal["CoSimulation", "ModelExchange"]


@dataclass(frozen=True)
class References:
    """Value references of what a replay sets and reads."""

    states: tuple[int, ...]
    rates: tuple[int, ...]
    inputs: tuple[int, ...]
    displacement: tuple[int, ...]
    velocity: tuple[int, ...]
    trust_ratio: int
    max_internal_step: int


@dataclass(frozen=True)
class Slave:
    """An instantiated unit: fmpy's object, its references, and the messages it has logged so far.

    ``fmu`` is fmpy's FMU2Slave, or for a unit of FMI 3.0 what takes the same calls.
    """

    fmu: Any
    references: References
    messages: list[str]


def fmpy_problems(path: Path | str) -> tuple[str, ...]:
    """What fmpy's validator finds wrong with a unit; empty for a valid one."""
    return tuple(validate_fmu(str(path)))


@contextmanager
def unpacked(path: Path | str) -> Iterator[str]:
    """The archive as a temporary folder.

    Raises
    ------
    InputError : a file of the archive is damaged.
    """
    try:
        folder = extract(str(path))
    except Exception as error:  # zipfile and zlib raise their own, fmpy plain Exception
        raise InputError(f"cannot be unpacked ({error})", where=str(path)) from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def opened_slave(path: Path | str) -> Iterator[Slave]:
    """An instance for Co-Simulation, freed on leaving; its messages are kept instead of printed.

    Raises
    ------
    InputError : when the unit has no binary for this machine or cannot be instantiated.
    """
    with unpacked(path) as folder:
        description = read_model_description(folder, validate=False)
        messages: list[str] = []
        try:
            fmu = new_unit(description, folder, "CoSimulation")
            fmu.instantiate(callbacks=collecting_callbacks(messages))
        except Exception as error:  # fmpy raises plain Exception for a missing library and a failed instantiation
            detail = "; ".join([str(error), *messages])
            raise InputError("the unit cannot be instantiated", where=str(path), value=detail) from error
        try:
            yield Slave(fmu, references(description.modelVariables), messages)
        finally:
            fmu.freeInstance()


def new_unit(description: Any, folder: str, kind: Kind, guid: str | None = None) -> Any:
    """fmpy's object for a unpacked unit of FMI 2.0, or the like for one of FMI 3.0; not instantiated.

    Parameters
    ----------
    description : what fmpy read from it.
    folder : where it lies.
    kind : interface.
    guid : another identifier than its own.
    """
    interface = description.coSimulation if kind == "CoSimulation" else description.modelExchange
    names = {
        "guid": guid or description.guid,
        "modelIdentifier": interface.modelIdentifier,
        "unzipDirectory": folder,
        "instanceName": "instance",
    }
    if description.fmiVersion.startswith("3"):
        variables = description.modelVariables
        return (Slave3 if kind == "CoSimulation" else Model3)(float_lengths(variables), load_inputs(variables), **names)
    return (FMU2Slave if kind == "CoSimulation" else FMU2Model)(**names)


def replay(
    path: Path | str, t: FloatArray, z0: ComplexArray, inputs: FloatArray | None = None, *, hold: Hold = "constant"
) -> FmuReplay:
    """Drive a unit from a start state over given times.

    Parameters
    ----------
    path : the unit.
    t : (n_time,) s, increasing; the communication points.
    z0 : (m,) start state.
    inputs : (n_time, n_input) at the times ``t``, SI units, or None for zero.
    hold : "constant" holds the value of the start of each step; "linear" passes its slope too
        (fmi2SetRealInputDerivatives).

    Raises
    ------
    InputError : when the unit cannot be used on this machine.
    NumericalError : when it reports an error, with its messages.
    """
    with opened_slave(path) as slave:
        try:
            return _replay(slave, t, z0, inputs, hold)
        except FMICallException as error:
            raise NumericalError(
                f"{error.function} failed", where=str(path), value="; ".join(slave.messages) or str(error)
            ) from error


def _replay(slave: Slave, t: FloatArray, z0: ComplexArray, inputs: FloatArray | None, hold: Hold) -> FmuReplay:
    fmu, vr = slave.fmu, slave.references
    n = len(vr.inputs)
    u = np.zeros((len(t), n)) if inputs is None else inputs
    if u.shape != (len(t), n) or 2 * len(z0) != len(vr.states):
        raise InputError("the inputs or the start state do not fit the unit", where="replay", value=(u.shape, len(z0)))
    fmu.setupExperiment(startTime=float(t[0]))
    fmu.setReal(vr.states, np.stack([z0.real, z0.imag], axis=-1).ravel().tolist())
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    read = [*vr.states, *vr.displacement, *vr.velocity, vr.trust_ratio]
    rows = [fmu.getReal(read)]
    for k in range(len(t) - 1):
        step = float(t[k + 1] - t[k])
        if n:
            fmu.setReal(vr.inputs, u[k].tolist())
        if n and hold == "linear":
            fmu.setRealInputDerivatives(vr.inputs, [1] * n, ((u[k + 1] - u[k]) / step).tolist())
        fmu.doStep(float(t[k]), step)
        rows.append(fmu.getReal(read))
    fmu.terminate()
    ends = np.cumsum([len(vr.states), len(vr.displacement), len(vr.velocity)])
    state, displacement, velocity, trust = np.split(np.array(rows), ends, axis=1)
    return FmuReplay(t, state, displacement, velocity, trust[:, 0])


def collecting_callbacks(messages: list[str]) -> fmi2CallbackFunctions:
    """Callbacks that append each message to a list instead of printing it."""

    def log(environment: int, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        messages.append(message.decode("utf-8", "replace").replace("%%", "%"))

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = defaultCallbacks.allocateMemory
    callbacks.freeMemory = defaultCallbacks.freeMemory
    return callbacks


def references(variables: list[Any]) -> References:
    """References by role: states are what a derivative points to, sensors are relative outputs in m and m/s."""

    if any(v.type == "Float64" for v in variables):
        return _references3(variables)

    def outputs(unit: str) -> tuple[int, ...]:
        return tuple(v.valueReference for v in reals if v.unit == unit and v.name in relative)

    reals = [v for v in variables if v.type == "Real"]
    named = {v.name for v in reals if v.causality == "output"}
    relative = {name for name in named if name.removesuffix("_absolute") not in named - {name}}
    return References(
        states=tuple(v.derivative.valueReference for v in reals if v.derivative is not None),
        rates=tuple(v.valueReference for v in reals if v.derivative is not None),
        inputs=load_inputs(variables),
        displacement=outputs("m"),
        velocity=outputs("m/s"),
        trust_ratio=next(v.valueReference for v in reals if v.name == "trust_ratio"),
        max_internal_step=next(v.valueReference for v in reals if v.name == "max_internal_step"),
    )


def load_inputs(variables: list[Any]) -> tuple[int, ...]:
    """References of the inputs that drive the model."""
    base = {name for name, _ in BASE_MOTION}
    return tuple(v.valueReference for v in variables if v.causality == "input" and v.name not in base)


def _references3(variables: list[Any]) -> References:
    """The same of a unit of FMI 3.0, whose states and sensors are arrays."""
    return References(
        states=elements(variables, "z"),
        rates=elements(variables, "der_z"),
        inputs=load_inputs(variables),
        displacement=elements(variables, "displacement"),
        velocity=elements(variables, "velocity"),
        trust_ratio=elements(variables, "trust_ratio")[0],
        max_internal_step=elements(variables, "max_internal_step")[0],
    )
