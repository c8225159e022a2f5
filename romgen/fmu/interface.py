"""The variables of a unit together with how they depend on each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from romgen.fmu.dependencies import sensor_states, state_couplings
from romgen.fmu.records import PLAIN, InterfaceOptions
from romgen.fmu.sensor_variables import BASE_MOTION, absolute_names, input_names, sensor_names, start_names
from romgen.fmu.variable import Variable
from romgen.fmu.variables import model_variables, state_names
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


def build_interface(model: ReducedModel, options: InterfaceOptions = PLAIN) -> FmuInterface:
    """Variables of a model and their dependencies, derived from its nonzero coefficients.

    No output depends directly on an input, but for the absolute ones on the motion of the base.

    Parameters
    ----------
    model : with m modes, n inputs, s sensors.
    options : ranges, absolute outputs, start values.
    """
    variables = model_variables(model, options)
    index = {v.name: k for k, v in enumerate(variables, 1)}
    states = {index[name] for name in state_names(model)}
    loads = {index[v.name] for v in variables if v.causality == "input"}
    rates, outputs = _rate_unknowns(model, index), _output_unknowns(model, index, options)
    starts = {index[name] for name in start_names(model)} if options.start_from_sensors else states
    gain = index["input_gain"]

    def at_start(unknown: Unknown) -> Unknown:
        """The same in initialisation, where the gain counts as known, and the states do not if they are computed."""
        known = set(unknown.dependencies)
        moved = known & states if starts == states else (starts if known & states else set())
        seen = (known - states) | moved
        return Unknown(unknown.index, tuple(sorted(seen | ({gain} if known & loads else set()))))

    inside = Unknown(index["inside_trust_region"], tuple(sorted(states)))
    initial = [at_start(unknown) for unknown in (*rates, *outputs)]
    initial.append(Unknown(inside.index, tuple(sorted(starts | {index["trust_radius"]}))))
    if options.start_from_sensors:
        initial += [Unknown(k, tuple(sorted(starts))) for k in (*sorted(states), index["start_misfit"])]
    by_index = tuple(sorted(initial, key=lambda unknown: unknown.index))
    return FmuInterface(variables, (*outputs, inside), tuple(rates), by_index)


def _rate_unknowns(model: ReducedModel, index: dict[str, int]) -> list[Unknown]:
    """The state derivatives."""
    state = [index[name] for name in state_names(model)]
    inputs = [index[name] for name in input_names(model)]
    couplings, driven = state_couplings(model), model.input_matrix != 0
    running = []
    for k, name in enumerate(state_names(model)):
        mode = k // 2
        states = [state[2 * j + part] for j in np.flatnonzero(couplings[mode]) for part in (0, 1)]
        loads = [inputs[i] for i in np.flatnonzero(driven[mode])]
        running.append(Unknown(index[f"der_{name}"], tuple(sorted(states + loads))))
    return running


def _output_unknowns(model: ReducedModel, index: dict[str, int], options: InterfaceOptions) -> list[Unknown]:
    """The Real outputs: sensors, amplitudes, phases, trust ratio."""
    state = [index[name] for name in state_names(model)]
    n, modes = len(model.sensors), range(len(model.eigenvalues))
    names = [pair[which] for which in (0, 1) for pair in sensor_names(model)]
    seen = [
        [state[2 * j + part] for j in np.flatnonzero(row) for part in (0, 1)] for row in np.vstack(sensor_states(model))
    ]
    sensors = [Unknown(index[name], tuple(row)) for name, row in zip(names, seen, strict=True)]
    if options.base_share is not None:
        for k, name in enumerate(absolute_names(model)):
            moved = [index[BASE_MOTION[k // n][0]]] if options.base_share[k % n] else []
            sensors.append(Unknown(index[name], tuple(sorted(seen[k] + moved))))
    polar = [
        Unknown(index[f"modal_{what}_{j + 1}"], (state[2 * j], state[2 * j + 1]))
        for what in ("amplitude", "phase")
        for j in modes
    ]
    return [*sensors, *polar, Unknown(index["trust_ratio"], tuple(state))]
