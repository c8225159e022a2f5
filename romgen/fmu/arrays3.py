"""The variables of a unit gathered into the arrays of FMI 3.0."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from romgen.errors import InputError
from romgen.fmu.interface import FmuInterface, Unknown
from romgen.fmu.records import InterfaceOptions
from romgen.fmu.sensor_variables import absolute_names, sensor_names, start_names
from romgen.fmu.variable import Variable
from romgen.fmu.variables import state_names
from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class ArrayVariable:
    """One variable of FMI 3.0: ``length`` elements, or a scalar for None.

    Attributes
    ----------
    name, description : of the whole.
    reference : value reference, that of the first element in the runtime.
    elements : the scalars of FMI 2.0 that it holds.
    length : number of elements; None for a scalar.
    derivative : reference of the array this one is the time derivative of.
    """

    name: str
    description: str
    reference: int
    elements: tuple[Variable, ...]
    length: int | None
    derivative: int | None = None

    @property
    def head(self) -> Variable:
        """The first element, which carries what all have in common."""
        return self.elements[0]

    @property
    def start(self) -> str | None:
        """Start values, one per element."""
        starts = [v.start for v in self.elements if v.start is not None]
        return " ".join(starts) if starts else None

    @property
    def nominal(self) -> float | None:
        """The largest nominal value: FMI 3.0 has one for the whole array."""
        values = [v.nominal for v in self.elements if v.nominal is not None]
        return max(values) if values else None


@dataclass(frozen=True)
class ArrayInterface:
    """All variables of FMI 3.0 and the entries of ModelStructure, (reference, references it depends on)."""

    arrays: tuple[ArrayVariable, ...]
    time_reference: int
    outputs: tuple[tuple[int, tuple[int, ...]], ...]
    derivatives: tuple[tuple[int, tuple[int, ...]], ...]
    initial_unknowns: tuple[tuple[int, tuple[int, ...]], ...]


def array_interface(model: ReducedModel, interface: FmuInterface, options: InterfaceOptions) -> ArrayInterface:
    """Gather the variables of FMI 2.0: states, sensors, modes become arrays, everything else stays a scalar.

    Raises
    ------
    InputError : when an input has the name of an array.
    """
    n_real = sum(v.unit is not None for v in interface.variables)
    group_of = {name: (group, text) for group, text, names in _groups(model, options) for name in names}
    arrays: list[ArrayVariable] = []
    members: dict[str, list[Variable]] = {}
    for v in interface.variables:
        members.setdefault(group_of.get(v.name, (v.name, ""))[0], []).append(v)
    for name, elements in members.items():
        head = elements[0]
        grouped = head.name in group_of
        if grouped != all(v.name in group_of for v in elements):
            raise InputError("an input has the name of an array of FMI 3.0", where="FMU export", value=name)
        reference = head.reference + (n_real if head.unit is None else 0)
        text = group_of[head.name][1] if grouped else head.description
        derivative = 0 if head.state is not None else None
        arrays.append(
            ArrayVariable(name, text, reference, tuple(elements), len(elements) if grouped else None, derivative)
        )
    index = {v.name: k for k, v in enumerate(interface.variables, 1)}
    reference_of = {index[v.name]: array.reference for array in arrays for v in array.elements}

    def gathered(unknowns: Iterable[Unknown]) -> tuple[tuple[int, tuple[int, ...]], ...]:
        seen: dict[int, set[int]] = {}
        for u in unknowns:
            seen.setdefault(reference_of[u.index], set()).update(reference_of[k] for k in u.dependencies)
        return tuple((reference, tuple(sorted(known))) for reference, known in seen.items())

    return ArrayInterface(
        tuple(arrays),
        len(interface.variables),
        gathered(interface.outputs),
        gathered(interface.derivatives),
        gathered(interface.initial_unknowns),
    )


def _groups(model: ReducedModel, options: InterfaceOptions) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Name, description and FMI 2.0 elements of each array."""
    m, states = len(model.eigenvalues), state_names(model)
    displacement, velocity = zip(*sensor_names(model), strict=True)
    at = "at the sensors " + ", ".join(model.sensors)
    free = "start values from the sensors" if options.start_from_sensors else "start values free"
    yield "z", f"normal-form coordinates re z_1, im z_1, re z_2, ..., {free}", states
    yield "der_z", "time derivatives of z", tuple(f"der_{name}" for name in states)
    yield "displacement", f"displacement relative to the base, from the rest state, {at}", displacement
    yield "velocity", f"velocity relative to the base {at}", velocity
    absolute, starts = absolute_names(model), start_names(model)
    n = len(model.sensors)
    yield "displacement_absolute", f"displacement in space {at}", absolute[:n]
    yield "velocity_absolute", f"velocity in space {at}", absolute[n:]
    yield "start_displacement", f"the start state shows this displacement best, {at}", starts[:n]
    yield "start_velocity", f"the start state shows this velocity best, {at}", starts[n:]
    modes = range(1, m + 1)
    yield "modal_amplitude", "amplitude of each mode", tuple(f"modal_amplitude_{j}" for j in modes)
    yield "modal_phase", "phase of each mode, -pi to pi, 0 at rest", tuple(f"modal_phase_{j}" for j in modes)
    yield "natural_frequency", "of each mode at zero amplitude", tuple(f"natural_frequency_{j}" for j in modes)
    yield "damping_ratio", "of each mode at zero amplitude", tuple(f"damping_ratio_{j}" for j in modes)
