"""What the eigenvalues of a fit on trajectories are tied to, and how well the data know it.

Over all amplitudes the linear part of a polynomial of low degree bends towards the large ones, so a band-passed start
takes it from the samples in which all modes are small. Band-passed signals have no rest position in them, which counts
there. How firm the tie may be is for the data to say: motions of a structure with friction disagree about the limit of
small amplitudes, each having left the joints in a state of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import BoolArray, ComplexArray
from romgen.chart import ReducedTrajectory
from romgen.jackknife import BLOCKS, jackknife_deviation
from romgen.normal_form import with_replicates
from romgen.resonance import ResonanceTable
from romgen.shooting_start import Start, regression, samples

# Small: every mode below this share of its largest amplitude, for so many periods of the slowest mode together.
SMALL, SMALL_PERIODS = 0.15, 20.0


@dataclass(frozen=True)
class LinearReference:
    """Eigenvalues with their uncertainty.

    Attributes
    ----------
    eigenvalues : (m,) 1/s; spread : (m,) standard deviations of Re and Im by the jackknife, 1/s.
    without : (n_block, m) the eigenvalues without each block of samples, see ``jackknife``.
    origin : "small motions", "all amplitudes", "the direct fit", or "given".
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    spread: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    without: ComplexArray = field(metadata={"unit": "1/s", "axes": "block,mode"})
    origin: str


def linear_reference(
    start: Start,
    training: Sequence[ReducedTrajectory],
    kept: Sequence[BoolArray],
    table: ResonanceTable,
    settings: tuple[float, bool],
) -> LinearReference:
    """Return the linear part of small motions where the start is band-passed, else that of the direct fit.

    Motions that end before all modes were small for SMALL_PERIODS, or that do not decay there, leave all samples.

    Parameters
    ----------
    kept : (n_time,) per trajectory, samples that count.
    settings : ridge of the direct fit; whether the linear part is given.
    """
    ridge, keep_linear = settings
    if start.direct is not None:
        seen = [r.masked(keep) for r, keep in zip(training, kept, strict=True)]
        others = with_replicates(start.direct, seen, ridge, keep_linear=keep_linear).replicates
        assert others is not None
        origin = "given" if keep_linear else "the direct fit"
        return LinearReference(start.dynamics.eigenvalues, _spread(others.eigenvalues), others.eigenvalues, origin)
    n_block, given = BLOCKS * len(training), start.dynamics.eigenvalues
    if keep_linear:
        return LinearReference(given, np.zeros_like(given), np.tile(given, (n_block, 1)), "given")
    Z, Z_dot, block = samples(start, training, kept)
    enough = SMALL_PERIODS * 2.0 * np.pi / given.imag.min() / min(r.t[1] - r.t[0] for r in training)

    def over(chosen: BoolArray) -> tuple[ComplexArray, bool]:
        return _small_eigenvalues(start, (Z[chosen], Z_dot[chosen]), table, enough)

    eigenvalues, is_small = over(np.ones(len(block), dtype=bool))
    counted = np.unique(block)
    # a block that is held out or distorted throughout has no part in the eigenvalues
    without = np.tile(eigenvalues, (n_block, 1))
    without[counted] = [over(block != b)[0] for b in counted]
    origin = "small motions" if is_small else "all amplitudes"
    return LinearReference(eigenvalues, _spread(without[counted]), without, origin)


def _spread(without: ComplexArray) -> ComplexArray:
    spread: ComplexArray = jackknife_deviation(without.real) + 1j * jackknife_deviation(without.imag)
    return spread


def _small_eigenvalues(
    start: Start, motion: tuple[ComplexArray, ComplexArray], table: ResonanceTable, enough: float
) -> tuple[ComplexArray, bool]:
    """Return Lambda (m,) by regression over the small samples and True, over all where there are not enough."""
    Z, Z_dot = motion
    small = (np.abs(Z) <= SMALL * np.abs(Z).max(axis=0)).all(axis=1)
    if small.sum() >= enough:
        eigenvalues = regression(start, (Z[small], Z_dot[small]), table, keep_linear=False)[0]
        if np.all(eigenvalues.real < 0.0):
            return eigenvalues, True
    return regression(start, motion, table, keep_linear=False)[0], False
