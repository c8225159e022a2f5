"""Units of the interface and their display units, as FMI 2.0 declares them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

STANDARD_GRAVITY = 9.80665
"""m/s2 (BIPM)."""


@dataclass(frozen=True)
class Unit:
    """An SI unit by its base exponents; a display value is ``factor`` times the SI value.

    Attributes
    ----------
    name : as used by the variables.
    quantity : name of the type that carries it.
    exponents : of kg, m, s, A, K, mol, cd, rad, only those that are not 0.
    display : (name, factor) of other units a tool may show.
    """

    name: str
    quantity: str
    exponents: dict[str, int] | None
    display: tuple[tuple[str, float], ...] = field(default=())


KNOWN = {
    unit.name: unit
    for unit in (
        Unit("1", "Dimensionless", {}),
        Unit("1/s", "Rate", {"s": -1}),
        Unit("s", "Time", {"s": 1}, (("ms", 1e3),)),
        Unit("rad", "Angle", {"rad": 1}, (("deg", 180.0 / math.pi),)),
        Unit("Hz", "Frequency", {"s": -1}),
        Unit("m", "Displacement", {"m": 1}, (("mm", 1e3), ("um", 1e6))),
        Unit("m/s", "Velocity", {"m": 1, "s": -1}, (("mm/s", 1e3),)),
        Unit("m/s2", "Acceleration", {"m": 1, "s": -2}, (("g", 1.0 / STANDARD_GRAVITY),)),
        Unit("N", "Force", {"kg": 1, "m": 1, "s": -2}, (("kN", 1e-3),)),
        Unit("N.m", "Moment", {"kg": 1, "m": 2, "s": -2}),
        Unit("Pa", "Pressure", {"kg": 1, "m": -1, "s": -2}, (("MPa", 1e-6), ("kPa", 1e-3))),
    )
}


def unit_of(name: str) -> Unit:
    """The unit of this name; one that is not known here is declared without base exponents."""
    return KNOWN.get(name, Unit(name, "Quantity_" + "".join(c if c.isalnum() else "_" for c in name), None))
