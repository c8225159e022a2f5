"""The variables of a unit together with how they depend on each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from romgen.fmu.dependencies import sensor_states, state_couplings
from romgen.fmu.variables import Variable, input_names, model_variables, sensor_names, state_names
from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class Unknown:
    """An entry of ModelStructure: 1-based index and the 1-based indices it depends on."""

    index: int
    dependencies: tuple[int, ...]


@dataclass(frozen=True)
class FmuInterface:
    """All variables and the three lists of ModelStructure."""

    variables: tuple[Variable, ...]
    outputs: tuple[Unknown, ...]
    derivatives: tuple[Unknown, ...]
    initial_unknowns: tuple[Unknown, ...]

    def index(self, name: str) -> int:
        """1-based index of a variable by name."""
        return next(k for k, v in enumerate(self.variables, 1) if v.name == name)


def build_interface(model: ReducedModel, input_range: tuple[tuple[float, float], ...] = ()) -> FmuInterface:
    """Variables of a model and their dependencies, derived from its nonzero coefficients.

    No output depends directly on an input.

    Parameters
    ----------
    model : with m modes, n inputs, s sensors.
    input_range : (minimum, maximum) of each input in training, or ().
    """
    variables = model_variables(model, input_range)
    index = {v.name: k for k, v in enumerate(variables, 1)}
    rates, initial_rates = _rate_unknowns(model, index)
    outputs = _output_unknowns(model, index)
    state = tuple(index[name] for name in state_names(model))
    inside = index["inside_trust_region"]
    initial = [*initial_rates, *outputs, Unknown(inside, (*state, index["trust_radius"]))]
    by_index = tuple(sorted(initial, key=lambda unknown: unknown.index))
    return FmuInterface(variables, (*outputs, Unknown(inside, state)), tuple(rates), by_index)


def _rate_unknowns(model: ReducedModel, index: dict[str, int]) -> tuple[list[Unknown], list[Unknown]]:
    """The state derivatives while running, and in initialisation, where the input gain counts as known."""
    state = [index[name] for name in state_names(model)]
    inputs = [index[name] for name in input_names(model)]
    couplings, driven = state_couplings(model), model.input_matrix != 0
    running, initial = [], []
    for k, name in enumerate(state_names(model)):
        mode = k // 2
        states = [state[2 * j + part] for j in np.flatnonzero(couplings[mode]) for part in (0, 1)]
        loads = [inputs[i] for i in np.flatnonzero(driven[mode])]
        gain = [index["input_gain"]] if loads else []
        running.append(Unknown(index[f"der_{name}"], tuple(sorted(states + loads))))
        initial.append(Unknown(index[f"der_{name}"], tuple(sorted(states + loads + gain))))
    return running, initial


def _output_unknowns(model: ReducedModel, index: dict[str, int]) -> list[Unknown]:
    """The Real outputs: sensors, amplitudes, trust ratio."""
    state = [index[name] for name in state_names(model)]
    displacement_names, velocity_names = zip(*sensor_names(model), strict=True)
    seen = dict(zip((*displacement_names, *velocity_names), np.vstack(sensor_states(model)), strict=True))
    sensors = [
        Unknown(index[name], tuple(state[2 * j + part] for j in np.flatnonzero(modes) for part in (0, 1)))
        for name, modes in seen.items()
    ]
    amplitudes = [
        Unknown(index[f"modal_amplitude_{j}"], (state[2 * j - 2], state[2 * j - 1]))
        for j in range(1, len(model.eigenvalues) + 1)
    ]
    return [*sensors, *amplitudes, Unknown(index["trust_ratio"], tuple(state))]
