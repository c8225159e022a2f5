"""A normal form on segments of motions: its simulation, and what the data change with its unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.dissipation import Demand
from romgen.output_map import OutputMap
from romgen.variational import motion, real_slopes, sensitivities

# Segments that are simulated at once.
THREADS = 2
T = TypeVar("T")


@dataclass(frozen=True)
class Segment:
    """A stretch of a motion with its own initial state.

    Attributes
    ----------
    t : (n_time,) s.
    eta : (n_time, m) modal displacement of the data.
    z0 : (m,) initial state of the model.
    kept : (n_time,) samples that count; the others are held out.
    motion : number of the motion it belongs to.
    share : weight of a sample, one over the largest norm of eta of the motion, as in the NMTE.
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    eta: FloatArray = field(metadata={"unit": "unit of eta", "axes": "time,mode"})
    z0: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})
    kept: BoolArray = field(metadata={"unit": "1", "axes": "time"})
    motion: int
    share: float


@dataclass(frozen=True)
class RefinedDynamics:
    """Normal form and displacement map during refinement.

    Attributes
    ----------
    eigenvalues : (m,) Lambda, 1/s; keep_linear : they stay as they are.
    reference, spread : (m,) the values that they are tied to; standard deviations of Re and Im by which they are known.
    amplitude : (m,) corner of the data, largest abs(z_j) over all motions.
    exponents : (n_term, 2m) degree >= 2; resonant : (m, n_term) terms of B; B : (m, n_term) 1/s.
    output : terms of the displacement; C : (m, n_output) their coefficients; rest : (n_motion, m) rest positions.
    cost : relative mean square misfit with priors and penalty.
    demand : where dissipation is demanded; None demands none.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    reference: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    spread: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    amplitude: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    resonant: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode,term"})
    output: OutputMap
    C: ComplexArray = field(metadata={"unit": "unit of eta", "axes": "mode,term"})
    rest: FloatArray = field(metadata={"unit": "unit of eta", "axes": "motion,mode"})
    cost: float = float("inf")
    keep_linear: bool = False
    demand: Demand | None = None


def simulated(model: RefinedDynamics, segments: Sequence[Segment], max_step: float) -> list[ComplexArray]:
    """Return z (n_time, m) of each segment from its initial state; not finite where it blows up."""
    kept = model.resonant.any(axis=0)
    form = model.exponents[kept], model.B[:, kept]
    return _each(lambda s: motion(s.t, s.z0, model.eigenvalues, form, max_step), segments)


def _each(work: Callable[[Segment], T], segments: Sequence[Segment]) -> list[T]:
    """Return the work on every segment, done by several threads; the results do not depend on their number."""
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(work, segments))


def output_jacobian(s: ComplexArray, W: list[ComplexArray]) -> FloatArray:
    """Return the derivative (n_sample, n_unknown) of a quantity with slopes s (n_sample, m), zeros where none."""
    m, shared = s.shape[1], 2 * (W[0].shape[2] - s.shape[1])
    J = np.zeros((len(s), shared + 2 * m * len(W)))
    first = 0
    for number, own in enumerate(W):
        block = slice(first, first + len(own))
        g = real_slopes(s[block], own)
        J[block, 0:shared:2], J[block, 1:shared:2] = g[:, :-m].real, -g[:, :-m].imag
        start = shared + 2 * m * number
        J[block, start : start + m], J[block, start + m : start + 2 * m] = g[:, -m:].real, -g[:, -m:].imag
        first += len(own)
    return J


def segment_sensitivities(model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float) -> list[ComplexArray]:
    """Return W (n_time, 2m, n_coefficient + m) of each segment, by Lambda and B, then by its initial state."""
    m, kept = len(model.eigenvalues), model.resonant.any(axis=0)
    rows, terms = np.nonzero(model.resonant[:, kept])
    parameters = np.concatenate([np.arange(m), rows]), np.concatenate([np.arange(m), m + terms])
    linear = np.eye(2 * m, dtype=np.int64)[:m]
    form = (np.vstack([linear, model.exponents[kept]]), np.hstack([np.zeros((m, m)), model.B[:, kept]]))
    return _each(lambda s: sensitivities(s.t, s.z0, model.eigenvalues, form, parameters, max_step)[1], segments)
