"""Units of FMI 3.0 behind the calls of fmpy's classes for FMI 2.0, so that one set of checks serves both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from fmpy.fmi2 import fmi2CallbackFunctions
from fmpy.fmi3 import FMU3Model, FMU3Slave


class ByElements:
    """Elements of arrays by numbers of their own, as the scalars of FMI 2.0 have them; mixed into fmpy's classes.

    Element i of an array has the reference of the array plus i: the references of romgen's units leave that room.
    """

    lengths: dict[int, int]
    """Elements of each Float64 by its value reference."""

    def _array(self, element: int) -> int:
        """The reference of the array that holds an element; a reference that is unknown stands for itself."""
        held = [r for r, n in self.lengths.items() if r <= element < r + n]
        return held[0] if held else element

    def _arrays(self, elements: Iterable[int]) -> list[int]:
        return sorted({self._array(element) for element in elements})

    def _elements(self, arrays: Iterable[int]) -> list[int]:
        return [r + i for r in arrays for i in range(self.lengths.get(r, 1))]

    def getReal(self: Any, elements: Sequence[int]) -> list[float]:
        """Values of elements."""
        arrays = self._arrays(elements)
        order = self._elements(arrays)
        values = dict(zip(order, self.getFloat64(arrays, len(order)), strict=True))
        return [values[element] for element in elements]

    def setReal(self: Any, elements: Sequence[int], values: Sequence[float]) -> None:
        """Set elements; the others of an array keep their values."""
        given = dict(zip(elements, values, strict=True))
        for array in self._arrays(elements):
            own = self._elements([array])
            kept = {} if set(own) <= set(given) else dict(zip(own, self.getReal(own), strict=True))
            self.setFloat64([array], [{**kept, **given}[element] for element in own])

    def setupExperiment(self: Any, startTime: float = 0.0) -> None:
        """FMI 3.0 takes the time when initialisation begins."""
        self.start_time = startTime

    def enterInitializationMode(self: Any) -> None:
        """Enter it at the time of setupExperiment."""
        super().enterInitializationMode(startTime=self.start_time)  # type: ignore[misc]

    def getDirectionalDerivative(
        self: Any, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float]
    ) -> list[float]:
        """Derivatives of elements along elements."""
        results, sources = self._arrays(unknowns), self._arrays(knowns)
        order, given = self._elements(results), dict(zip(knowns, seed, strict=True))
        seeds = [given.get(element, 0.0) for element in self._elements(sources)]
        found = super().getDirectionalDerivative(results, sources, seeds, len(order))  # type: ignore[misc]
        values = dict(zip(order, found, strict=True))
        return [values[element] for element in unknowns]


class Slave3(ByElements, FMU3Slave):  # type: ignore[misc]
    """Co-Simulation; slopes of inputs, which FMI 3.0 does not have, are given through intermediate updates."""

    def __init__(self, lengths: dict[int, int], inputs: Sequence[int], **names: str) -> None:
        super().__init__(**names)
        self.lengths, self.inputs = lengths, tuple(inputs)
        self.value = dict.fromkeys(self.inputs, 0.0)
        self.slope: dict[int, float] = {}
        self.start_time = self.step_start = 0.0

    def instantiate(self, callbacks: fmi2CallbackFunctions) -> None:
        """Make the instance; its messages go to the logger of FMI 2.0."""

        def log(environment: int, status: int, category: bytes, message: bytes) -> None:
            callbacks.logger(None, b"", status, category, message)

        super().instantiate(logMessage=log, intermediateUpdate=self._update)

    def _update(self, environment: int, time: float, set_requested: bool, *_: object) -> None:
        if set_requested and self.slope:
            elapsed = time - self.step_start
            values = [self.value[r] + self.slope.get(r, 0.0) * elapsed for r in self.inputs]
            self.setFloat64(self.inputs, values)

    def setReal(self, elements: Sequence[int], values: Sequence[float]) -> None:
        """Set elements; an input that is set forgets its slope."""
        super().setReal(elements, values)
        for element, value in zip(elements, values, strict=True):
            if element in self.value:
                self.value[element] = float(value)
                self.slope.pop(element, None)

    def setRealInputDerivatives(self, elements: Sequence[int], order: Sequence[int], slopes: Sequence[float]) -> None:
        """Slopes of inputs from the next step on."""
        self.slope.update(zip(elements, slopes, strict=True))

    def doStep(self, time: float, step: float) -> None:
        """One step; inputs with a slope stand at their end value afterwards."""
        self.step_start = time
        super().doStep(time, step)
        for element, slope in self.slope.items():
            self.value[element] += slope * step

    def reset(self) -> None:
        """As fresh."""
        super().reset()
        self.value, self.slope = dict.fromkeys(self.inputs, 0.0), {}


class Model3(ByElements, FMU3Model):  # type: ignore[misc]
    """Model Exchange."""

    def __init__(self, lengths: dict[int, int], inputs: Sequence[int], **names: str) -> None:
        super().__init__(**names)
        self.lengths, self.start_time = lengths, 0.0

    def instantiate(self, callbacks: fmi2CallbackFunctions) -> None:
        """Make the instance; its messages are dropped."""
        super().instantiate(logMessage=lambda *_: None)


SLAVE_NAMES = {
    "getFMUstate": "getFMUState",
    "setFMUstate": "setFMUState",
    "freeFMUstate": "freeFMUState",
    "serializeFMUstate": "serializeFMUState",
    "deSerializeFMUstate": "deserializeFMUState",
    "fmi2FreeInstance": "fmi3FreeInstance",
}
MODEL_NAMES = {"newDiscreteStates": "updateDiscreteStates", "getDerivatives": "getContinuousStateDerivatives"}
"""Calls that differ by their name only."""

for kind, renamed in ((Slave3, SLAVE_NAMES), (Model3, MODEL_NAMES)):
    for old, new in renamed.items():
        setattr(kind, old, getattr(kind, new))


def float_lengths(variables: Sequence[Any]) -> dict[int, int]:
    """Elements of each Float64 by its value reference."""
    reals = [v for v in variables if v.type == "Float64"]
    return {v.valueReference: int(v.dimensions[0].start) if v.dimensions else 1 for v in reals}


def elements(variables: Sequence[Any], name: str) -> tuple[int, ...]:
    """Numbers of the elements of one variable."""
    first = next(v.valueReference for v in variables if v.name == name)
    return tuple(first + i for i in range(float_lengths(variables)[first]))
