"""Numbers with units: "9.1 kN" -> 9100.0 N."""

from __future__ import annotations

import re
from collections.abc import Callable

UNITS: dict[str, dict[str, float]] = {
    "1": {"": 1.0, "%": 1e-2},
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "in": 0.0254},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "m/s^2": {"m/s^2": 1.0, "m/s2": 1.0, "mm/s^2": 1e-3, "g": 9.80665},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm^2": 1e6},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3, "t/mm^3": 1e12, "kg/mm^3": 1e9},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "kN/m": 1e3, "kN/mm": 1e6},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "N/m^3": {"N/m^3": 1.0, "N/mm^3": 1e9, "MPa/mm": 1e9, "GPa/m": 1e9},
}
"""Accepted units of each SI unit and their factor to it."""

MICRO = str.maketrans("\N{MICRO SIGN}\N{GREEK SMALL LETTER MU}", "uu")
"""Both characters that keyboards and programs write for micro, as the u that ``UNITS`` has."""

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*")


def parse_quantity(value: object, unit: str) -> object:
    """Return a text such as "9.1 kN" as a number in the SI ``unit``; other values pass unchanged.

    Raises
    ------
    ValueError : the text is not "number unit", or the unit is not one of ``UNITS[unit]``.
    """
    if not isinstance(value, str):
        return value
    match = _QUANTITY.fullmatch(value)
    if match is None:
        raise ValueError(f"not a number with a unit, such as 1.5 or '1.5 {unit}'")
    number, symbol = match.groups()
    return float(number) * unit_factor(symbol, unit)


def unit_factor(symbol: str, unit: str) -> float:
    """Return the factor of a unit such as "mm" to the SI ``unit``; every character for micro is taken (``MICRO``).

    Raises
    ------
    ValueError : it is not one of ``UNITS[unit]``.
    """
    known, plain = UNITS[unit], symbol.translate(MICRO)
    if plain not in known:
        raise ValueError(f"unknown unit '{symbol}', accepted are {', '.join(u for u in known if u)}")
    return known[plain]


def in_unit(unit: str) -> Callable[[object], object]:
    """Return the converter to the SI ``unit`` that a settings field runs before its own validation."""

    def convert(value: object) -> object:
        return parse_quantity(value, unit)

    return convert
