"""The variables of a unit; the order is the one the C runtime counts in."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from romgen.etdrk4 import largest_step
from romgen.fmu.coefficients import HARD_LIMIT
from romgen.fmu.magnitudes import nominal_displacement, nominal_velocity
from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class Variable:
    """One ScalarVariable; ``None`` leaves an attribute out.

    ``reference`` counts Real and Boolean variables apart; ``state`` is the 1-based index of the variable
    this one is the time derivative of; ``unit`` is None for a Boolean.
    """

    name: str
    reference: int
    description: str
    causality: str
    variability: str
    initial: str | None
    unit: str | None = "1"
    start: str | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    state: int | None = None


def model_variables(model: ReducedModel, input_range: tuple[tuple[float, float], ...] = ()) -> tuple[Variable, ...]:
    """All variables of a unit in the order the C runtime counts in.

    Parameters
    ----------
    model : with m modes, n inputs, s sensors.
    input_range : (minimum, maximum) of each input in training, or ().
    """
    reals = (
        *_states(model),
        *_rates(model),
        *_inputs(model, input_range),
        *_sensors(model),
        *_amplitudes(model),
        *_parameters(model),
        *_constants(model),
    )
    return (*(replace(v, reference=k) for k, v in enumerate(reals)), *_booleans())


def sensor_names(model: ReducedModel) -> tuple[tuple[str, str], ...]:
    """Names of the displacement and velocity output of each sensor: letters, digits and underscores, unique."""
    clean = [re.sub(r"[^0-9A-Za-z_]", "_", name) for name in model.sensors]
    pairs = tuple((f"{name}_displacement", f"{name}_velocity") for name in clean)
    taken = {name for pair in pairs for name in pair} | set(input_names(model))
    legal = all(re.match(r"[A-Za-z_]", name) for name in clean)
    if legal and len(taken) == 2 * len(pairs) + len(model.inputs):
        return pairs
    return tuple((f"y_{k}_{name}", f"v_{k}_{name}") for k, name in enumerate(clean, 1))


def input_names(model: ReducedModel) -> tuple[str, ...]:
    """Names of the inputs: letters, digits and underscores."""
    return tuple(re.sub(r"[^0-9A-Za-z_]", "_", name) for name in model.inputs)


def state_names(model: ReducedModel) -> tuple[str, ...]:
    """z1_re, z1_im, z2_re, ..."""
    return tuple(f"z{j}_{part}" for j in range(1, len(model.eigenvalues) + 1) for part in ("re", "im"))


def _states(model: ReducedModel) -> list[Variable]:
    nominal = np.repeat(model.trained_amplitude, 2)
    return [
        Variable(
            name,
            0,
            "normal-form coordinate, start value free",
            "local",
            "continuous",
            "exact",
            "1",
            "0",
            nominal=float(a),
        )
        for name, a in zip(state_names(model), nominal, strict=True)
    ]


def _rates(model: ReducedModel) -> list[Variable]:
    omega = np.repeat(np.abs(model.eigenvalues) * model.trained_amplitude, 2)
    return [
        Variable(
            f"der_{name}",
            0,
            f"time derivative of {name}",
            "local",
            "continuous",
            "calculated",
            "1/s",
            nominal=_two_digits(float(r)),
            state=k,
        )
        for k, (name, r) in enumerate(zip(state_names(model), omega, strict=True), 1)
    ]


def _inputs(model: ReducedModel, input_range: tuple[tuple[float, float], ...]) -> list[Variable]:
    ranges: tuple[tuple[float | None, float | None], ...] = input_range or ((None, None),) * len(model.inputs)
    return [
        Variable(
            name,
            0,
            f"load input {given}, linear in each step through fmi2SetRealInputDerivatives, held otherwise",
            "input",
            "continuous",
            None,
            unit,
            "0",
            low,
            high,
        )
        for name, given, unit, (low, high) in zip(
            input_names(model), model.inputs, model.input_units, ranges, strict=True
        )
    ]


def _sensors(model: ReducedModel) -> list[Variable]:
    names = sensor_names(model)
    x, v = nominal_displacement(model), nominal_velocity(model)
    displacement = [
        _output(pair[0], f"displacement at sensor {given} relative to the base, from the rest state", "m", float(a))
        for pair, given, a in zip(names, model.sensors, x, strict=True)
    ]
    velocity = [
        _output(pair[1], f"velocity at sensor {given} relative to the base", "m/s", float(a))
        for pair, given, a in zip(names, model.sensors, v, strict=True)
    ]
    return displacement + velocity


def _output(name: str, description: str, unit: str, nominal: float, minimum: float | None = None) -> Variable:
    return Variable(
        name,
        0,
        description,
        "output",
        "continuous",
        "calculated",
        unit,
        minimum=minimum,
        nominal=_two_digits(nominal),
    )


def _amplitudes(model: ReducedModel) -> list[Variable]:
    return [
        *(
            _output(f"modal_amplitude_{j}", f"amplitude |z_{j}| of mode {j}", "1", float(a), 0.0)
            for j, a in enumerate(model.trained_amplitude, 1)
        ),
        _output("trust_ratio", "largest modal amplitude in units of the largest trained one", "1", 1.0, 0.0),
    ]


def _parameters(model: ReducedModel) -> list[Variable]:
    def parameter(name: str, description: str, variability: str, unit: str, start: float) -> Variable:
        return Variable(name, 0, description, "parameter", variability, "exact", unit, repr(start))

    return [
        parameter("input_gain", "factor on all inputs", "tunable", "1", 1.0),
        parameter(
            "trust_radius", "trust_ratio above which inside_trust_region is false; positive", "tunable", "1", 1.0
        ),
        parameter(
            "hard_limit", "trust_ratio above which a step fails and is not taken; positive", "tunable", "1", HARD_LIMIT
        ),
        parameter(
            "max_internal_step",
            "longest step of the integrator; positive",
            "fixed",
            "s",
            largest_step(model.eigenvalues),
        ),
    ]


def _constants(model: ReducedModel) -> list[Variable]:
    def constant(name: str, description: str, unit: str, value: float) -> Variable:
        return Variable(name, 0, description, "local", "constant", "exact", unit, repr(value))

    omega = np.abs(model.eigenvalues)
    zeta = -model.eigenvalues.real / omega
    return [
        *(
            constant(f"natural_frequency_{j}", f"of mode {j} at zero amplitude", "Hz", float(w) / (2.0 * math.pi))
            for j, w in enumerate(omega, 1)
        ),
        *(
            constant(f"damping_ratio_{j}", f"of mode {j} at zero amplitude", "1", float(d))
            for j, d in enumerate(zeta, 1)
        ),
    ]


def _booleans() -> tuple[Variable, ...]:
    inside = "true while the motion is in the trained range (trust_ratio <= trust_radius)"
    warn = "leaving the trained range is reported as a warning (true) or only logged (false)"
    return (
        Variable("inside_trust_region", 0, inside, "output", "discrete", "calculated", None),
        Variable("warn_on_crossing", 1, warn, "parameter", "tunable", "exact", None, "true"),
    )


def _two_digits(value: float) -> float:
    """Two significant digits, so that a nominal value does not change with round-off; 1 for 0."""
    return float(f"{value:.1e}") or 1.0
