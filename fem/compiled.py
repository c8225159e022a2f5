"""Compilation of inner loops to machine code, with their types kept.

Sums may be reordered and contracted (SIMD, fused multiply-add); nan and inf keep their meaning, so that blow-ups are
seen.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")
_SIMD = {"contract", "reassoc", "nsz", "arcp"}


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop over arrays on first use and keep the machine code beside its source."""
    return cast("Callable[P, R]", numba.njit(cache=True, fastmath=_SIMD)(function))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a formula into the loops that call it."""
    return cast("Callable[P, R]", numba.njit(cache=True, fastmath=_SIMD, inline="always")(function))


def threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop whose ``prange`` iterations are independent, and share them out to all threads."""
    return cast("Callable[P, R]", numba.njit(cache=True, fastmath=_SIMD, parallel=True)(function))


def threaded_gather(function: Callable[P, R]) -> Callable[P, R]:
    """``threaded`` for sums over scattered entries: sums keep their order.

    Reordering lets the compiler load such entries with vector gathers, which is four to nine times slower here.
    """
    return cast("Callable[P, R]", numba.njit(cache=True, fastmath={"contract"}, parallel=True)(function))
