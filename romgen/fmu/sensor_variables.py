"""What a unit shows of its sensors: relative and absolute motion, and start values."""

from __future__ import annotations

import re

from romgen.fmu.magnitudes import nominal_displacement, nominal_velocity
from romgen.fmu.records import InterfaceOptions
from romgen.fmu.variable import Variable, output, parameter
from romgen.reduced_model import ReducedModel

BASE_MOTION = (("base_displacement", "m"), ("base_velocity", "m/s"))
"""Inputs that absolute outputs need, in the order the C runtime counts in."""


def sensor_names(model: ReducedModel) -> tuple[tuple[str, str], ...]:
    """Names of the displacement and velocity output of each sensor: letters, digits and underscores, unique."""
    clean = [re.sub(r"[^0-9A-Za-z_]", "_", name) for name in model.sensors]
    pairs = tuple((f"{name}_displacement", f"{name}_velocity") for name in clean)
    taken = {name for pair in pairs for name in pair} | set(input_names(model)) | {name for name, _ in BASE_MOTION}
    legal = all(re.match(r"[A-Za-z_]", name) for name in clean)
    if legal and len(taken) == 2 * len(pairs) + len(set(input_names(model)) | {name for name, _ in BASE_MOTION}):
        return pairs
    return tuple((f"y_{k}_{name}", f"v_{k}_{name}") for k, name in enumerate(clean, 1))


def input_names(model: ReducedModel) -> tuple[str, ...]:
    """Names of the inputs: letters, digits and underscores."""
    return tuple(re.sub(r"[^0-9A-Za-z_]", "_", name) for name in model.inputs)


def absolute_names(model: ReducedModel) -> tuple[str, ...]:
    """Names of the absolute displacements, then velocities."""
    pairs = sensor_names(model)
    return tuple(name + "_absolute" for which in (0, 1) for name in (pair[which] for pair in pairs))


def start_names(model: ReducedModel) -> tuple[str, ...]:
    """Names of the start displacements, then velocities."""
    pairs = sensor_names(model)
    return tuple("start_" + pair[which] for which in (0, 1) for pair in pairs)


def base_motion() -> list[Variable]:
    """Displacement and velocity of the base, inputs of the absolute outputs."""
    meaning = "of the base, added to the absolute outputs; drives nothing"
    return [
        Variable(name, 0, f"{name.split('_')[1]} {meaning}", "input", "continuous", None, unit, "0")
        for name, unit in BASE_MOTION
    ]


def sensor_outputs(model: ReducedModel) -> list[Variable]:
    """Displacement and velocity of each sensor relative to the base."""
    names = sensor_names(model)
    x, v = nominal_displacement(model), nominal_velocity(model)
    displacement = [
        output(pair[0], f"displacement at sensor {given} relative to the base, from the rest state", "m", float(a))
        for pair, given, a in zip(names, model.sensors, x, strict=True)
    ]
    velocity = [
        output(pair[1], f"velocity at sensor {given} relative to the base", "m/s", float(a))
        for pair, given, a in zip(names, model.sensors, v, strict=True)
    ]
    return displacement + velocity


def absolute_outputs(model: ReducedModel, options: InterfaceOptions) -> list[Variable]:
    """Displacement and velocity of each sensor in space, () unless asked for."""
    if options.base_share is None:
        return []
    relative = sensor_outputs(model)
    return [
        output(name, r.description.split(" relative")[0] + " in space", r.unit or "1", r.nominal or 1.0)
        for name, r in zip(absolute_names(model), relative, strict=True)
    ]


def start_values(model: ReducedModel, options: InterfaceOptions) -> list[Variable]:
    """Displacements and velocities to start from and how well the model can show them, () unless asked for."""
    if not options.start_from_sensors:
        return []
    units = ["m"] * len(model.sensors) + ["m/s"] * len(model.sensors)
    given = [
        parameter(name, "the start state is the one whose sensors show this best", "fixed", unit, 0.0)
        for name, unit in zip(start_names(model), units, strict=True)
    ]
    text = "what the start state leaves of the start displacements and velocities, relative"
    return [*given, Variable("start_misfit", 0, text, "calculatedParameter", "fixed", "calculated", "1")]
