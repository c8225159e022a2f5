"""The variables of a unit; the order is the one the C runtime counts in."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from romgen.etdrk4 import largest_step
from romgen.fmu.coefficients import HARD_LIMIT
from romgen.fmu.records import PLAIN, InterfaceOptions
from romgen.fmu.sensor_variables import (
    absolute_outputs,
    base_motion,
    input_names,
    sensor_outputs,
    start_values,
)
from romgen.fmu.variable import Variable, output, parameter, two_digits
from romgen.reduced_model import ReducedModel


def model_variables(model: ReducedModel, options: InterfaceOptions = PLAIN) -> tuple[Variable, ...]:
    """All variables of a unit in the order the C runtime counts in.

    Parameters
    ----------
    model : with m modes, n inputs, s sensors.
    options : ranges, absolute outputs, start values.
    """
    reals = (
        *_states(model, options),
        *_rates(model),
        *_inputs(model, options.input_range),
        *(base_motion() if options.base_share is not None else ()),
        *sensor_outputs(model),
        *absolute_outputs(model, options),
        *_amplitudes(model),
        *_parameters(model),
        *start_values(model, options),
        *_constants(model),
    )
    return (*(replace(v, reference=k) for k, v in enumerate(reals)), *_booleans())


def state_names(model: ReducedModel) -> tuple[str, ...]:
    """z1_re, z1_im, z2_re, ..."""
    return tuple(f"z{j}_{part}" for j in range(1, len(model.eigenvalues) + 1) for part in ("re", "im"))


def _states(model: ReducedModel, options: InterfaceOptions) -> list[Variable]:
    nominal = np.repeat(model.trained_amplitude, 2)
    given = not options.start_from_sensors
    text = "normal-form coordinate, start value " + ("free" if given else "from the sensors")
    initial, start = ("exact", "0") if given else ("calculated", None)
    return [
        Variable(name, 0, text, "local", "continuous", initial, "1", start, nominal=float(a))
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
            nominal=two_digits(float(r)),
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
            f"load input {given}, held within a step unless the importer gives its course there",
            "input",
            "continuous",
            None,
            unit,
            "0",
            low,
            high,
            None if low is None or high is None else two_digits(max(abs(low), abs(high))),
        )
        for name, given, unit, (low, high) in zip(
            input_names(model), model.inputs, model.input_units, ranges, strict=True
        )
    ]


def _amplitudes(model: ReducedModel) -> list[Variable]:
    return [
        *(
            output(f"modal_amplitude_{j}", f"amplitude |z_{j}| of mode {j}", "1", float(a), 0.0)
            for j, a in enumerate(model.trained_amplitude, 1)
        ),
        *(
            output(f"modal_phase_{j}", f"phase arg z_{j} of mode {j}, -pi to pi, 0 at rest", "rad", 1.0)
            for j in range(1, len(model.eigenvalues) + 1)
        ),
        output("trust_ratio", "distance measure of the trained range: 1 on its boundary", "1", 1.0, 0.0),
    ]


def _parameters(model: ReducedModel) -> list[Variable]:
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
