"""Compilation of inner loops to machine code, with their types kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop over arrays on first use and keep the machine code beside its source."""
    return cast("Callable[P, R]", numba.njit(cache=True)(function))


def compiled_unlocked(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as ``compiled``, and let other Python threads run meanwhile: for long loops over arrays of their own."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True)(function))
