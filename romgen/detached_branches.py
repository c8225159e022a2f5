"""Search for solution branches that continuation from one start does not reach (isolas, other families)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.branch import Branch, ContinuationSettings
from romgen.continuation import continue_branch, solve_at, switch_branch
from romgen.errors import NumericalError
from romgen.forced_curve import ForcedSystem

# Two solutions are the same where they differ by less than this share of the state scale.
SAME = 1e-5
ROUNDING = 1e-9
MOST_BRANCHES = 8
SEARCH_ITERATIONS = 15


def detached_branches(
    system: ForcedSystem,
    known: list[Branch],
    starts: Iterable[tuple[FloatArray, float]],
    largest: FloatArray,
    settings: ContinuationSettings,
) -> list[Branch]:
    """Return the branches through solutions that Newton's method finds from ``starts`` and no known branch holds.

    Parameters
    ----------
    known : branches already followed.
    starts : guesses (state x, Omega in rad/s).
    largest : (m,) solutions outside the ellipsoid sum_j abs(q_j / largest_j)^2 = 1 are not followed: the model was not
        trained on such amplitudes together.
    settings : of the continuation, also of the Newton iterations.
    """
    found: list[Branch] = []
    for start, omega in starts:
        try:
            x = solve_at(system, start, omega, replace(settings, iterations=SEARCH_ITERATIONS))
        except NumericalError:  # most random starts lead nowhere; only solutions count
            continue
        if np.linalg.norm(system.modal(x[None])[0] / largest) > 1.0:
            continue
        if any(_holds(system, branch, x, omega, settings) for branch in [*known, *found]):
            continue
        found.append(continue_branch(system, x, omega, settings))
        if len(found) == MOST_BRANCHES:
            break
    return found


def crossing_starts(
    system: ForcedSystem, branches: list[Branch], settings: ContinuationSettings
) -> list[tuple[FloatArray, float]]:
    """Return a solution on the other branch through every branch point of ``branches``."""
    starts: list[tuple[FloatArray, float]] = []
    for branch in branches:
        for point in branch.located("branch_point"):
            try:
                starts.append(switch_branch(system, branch.x[point.index], point.p, settings))
            except NumericalError:  # two branches that only touch within rounding: nothing to switch to
                continue
    return starts


def random_starts(
    largest: FloatArray, omega_range: tuple[float, float], frequencies: int, tries: int
) -> list[tuple[ComplexArray, float]]:
    """Return guesses with abs(q_j) uniform up to ``largest`` (m,) and any phase, on a grid of frequencies in rad/s.

    The generator has a fixed seed: the same study finds the same branches.
    """
    generator = np.random.default_rng(0)
    grid = np.linspace(*omega_range, frequencies)
    size = (frequencies, tries, largest.size)
    q = largest * generator.random(size) * np.exp(2j * np.pi * generator.random(size))
    return [(start, float(omega)) for omega, row in zip(grid, q, strict=True) for start in row]


def _holds(system: ForcedSystem, branch: Branch, x: FloatArray, omega: float, settings: ContinuationSettings) -> bool:
    """Tell whether a branch passes through x, or through its image under a shift by whole forcing periods."""
    tolerance = SAME * settings.state_scale
    # The end of a branch may miss the end of the range by rounding.
    inside = float(np.clip(omega, branch.p.min(), branch.p.max()))
    bracketed = inside if abs(inside - omega) <= ROUNDING * omega else omega
    for i, j in pairwise(range(branch.p.size)):
        a, b = branch.p[i] - bracketed, branch.p[j] - bracketed
        if a * b > 0.0:
            continue
        share = a / (a - b) if a != b else 0.0
        near = branch.x[i] + share * (branch.x[j] - branch.x[i])
        try:
            there = solve_at(system, near, omega, settings)
        except NumericalError:  # at a fold the interpolated point may have no solution at this frequency
            there = near
        if min(float(np.max(np.abs(there - image))) for image in _images(system, x)) < tolerance:
            return True
    return False


def _images(system: ForcedSystem, x: FloatArray) -> list[FloatArray]:
    """Return the r_f states that are the same motion, shifted by whole forcing periods 2 pi / Omega."""
    return [system.shifted(x, k) for k in range(system.forced)]
