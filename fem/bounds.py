"""Numbers that a setting may have."""

from __future__ import annotations

import math
from numbers import Integral, Real

from fem.errors import FemInputError


def real(value: object) -> float:
    """The number that a setting is, or nan, which lies within no bounds: text and tables are none."""
    try:
        return math.nan if isinstance(value, str) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return math.nan


def require(where: str, name: str, value: object, least: float, *, above: bool = False, most: float = math.inf) -> None:
    """Refuse a setting that is not finite, below ``least`` (or at it, where it must be ``above``) or over ``most``."""
    number = float(value) if isinstance(value, Real) else math.nan
    if math.isfinite(number) and (number > least if above else number >= least) and number <= most:
        return
    bound = f"{'above' if above else 'at least'} {least:g}" + (f" and at most {most:g}" if most < math.inf else "")
    raise FemInputError(f"{name} out of range", where=where, value=value, advice=f"give a number {bound}")


def require_count(where: str, name: str, value: object, least: int, *, most: float = math.inf) -> None:
    """Refuse a count that is not a whole number from ``least`` to ``most``; 2.5 steps, and 2.0, are none."""
    if isinstance(value, Integral) and least <= int(value) <= most:
        return
    bound = f"at least {least}" + (f" and at most {most:g}" if most < math.inf else "")
    advice = f"give a whole number {bound}"
    raise FemInputError(f"{name} out of range", where=where, value=value, advice=advice)
