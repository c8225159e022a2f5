"""One variable of a unit, and the makers of its usual kinds."""

from __future__ import annotations

from dataclasses import dataclass


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


def output(name: str, description: str, unit: str, nominal: float, minimum: float | None = None) -> Variable:
    """A continuous output computed from the states; its nominal value is rounded to two digits."""
    nominal = two_digits(nominal)
    return Variable(name, 0, description, "output", "continuous", "calculated", unit, minimum=minimum, nominal=nominal)


def parameter(name: str, description: str, variability: str, unit: str, start: float) -> Variable:
    """A parameter with a start value."""
    return Variable(name, 0, description, "parameter", variability, "exact", unit, repr(start))


def two_digits(value: float) -> float:
    """Two significant digits, so that a nominal value does not change with round-off; 1 for 0."""
    return float(f"{value:.1e}") or 1.0
