"""Which monomials stay in the normal form: near-resonant terms, chosen by a gap, a tolerance or exact integers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.errors import InputError
from romgen.polynomial import zeta

# Resonances 1:1, 1:2 and 1:3 show in terms of degree 2 and 3; weaker ones only at higher degree.
GAP_ORDER = 3
LARGEST_INTEGER = 4


@dataclass(frozen=True)
class ResonanceTable:
    """Monomials of degree >= 2 kept in each row of the normal form, with the reason.

    Attributes
    ----------
    exponents : (n_term, 2m) over (z, conj z).
    detuning : (m, n_term) abs(Im(lambda_j - <m_k, lambda>)), rad/s.
    resonant : (m, n_term) True where the term is kept.
    tolerance : rad/s, largest detuning that was kept by size; nan where integers decided.
    internal_resonance : the integers r_j, () where size decided.
    reason : one sentence.
    """

    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    detuning: FloatArray = field(metadata={"unit": "rad/s", "axes": "mode,term"})
    resonant: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})
    tolerance: float
    internal_resonance: tuple[int, ...]
    reason: str


def integer_resonance(eigenvalues: ComplexArray, exponents: IntArray, integers: tuple[int, ...]) -> ResonanceTable:
    """Keep zeta^m in row j iff sum_k r_k (m_k - mbar_k) = r_j, r the ``integers``.

    Parameters
    ----------
    eigenvalues : (m,) 1/s.
    exponents : (n_term, 2m).
    integers : one positive integer per mode, e.g. (1, 2).
    """
    m = len(eigenvalues)
    if len(integers) != m or min(integers) < 1:
        raise InputError("needs one positive integer per mode", where="internal_resonance", value=integers)
    r = np.array(integers)
    resonant = (exponents[:, :m] - exponents[:, m:]) @ r == r[:, None]
    ratio = ":".join(map(str, integers))
    return ResonanceTable(
        exponents, _detuning(eigenvalues, exponents), resonant, float("nan"), integers, f"exact {ratio} combinations"
    )


def tolerance_resonance(eigenvalues: ComplexArray, exponents: IntArray, tolerance: float) -> ResonanceTable:
    """Keep zeta^m in row j iff abs(lambda_j - <m, lambda>) < tolerance (rad/s), the rule of the published models."""
    distance = np.abs(eigenvalues[:, None] - zeta(eigenvalues) @ exponents.T)
    reason = f"abs(lambda_j - <m, lambda>) < {tolerance:.4g} 1/s"
    return ResonanceTable(exponents, _detuning(eigenvalues, exponents), distance < tolerance, tolerance, (), reason)


def trivial_resonance(eigenvalues: ComplexArray, exponents: IntArray) -> ResonanceTable:
    """Keep only z_j abs(z_1)^2a abs(z_2)^2b ..: amplitude-dependent frequency and damping, no exchange of energy."""
    m = len(eigenvalues)
    difference = exponents[:, :m] - exponents[:, m:]
    resonant = (difference[None] == np.eye(m, dtype=np.int64)[:, None]).all(axis=2)
    reason = "no internal resonance: only products of z_j with abs(z_k)^2"
    return ResonanceTable(exponents, _detuning(eigenvalues, exponents), resonant, float("nan"), (), reason)


def automatic_resonance(eigenvalues: ComplexArray, exponents: IntArray) -> ResonanceTable:
    """Keep the terms below the widest gap of the detunings of degree 2 and 3, continued to all degrees as integers.

    The frequency detunings abs(omega_j - <m, omega>) of degree 2 and 3 up to the slowest frequency are sorted; the
    widest gap between neighbours separates resonant from non-resonant. A kept set that is the one of small integers
    (1:1, 1:2, 1:3, 2:3, ..) is continued to every degree by these integers, one of products with abs(z_k)^2 by those,
    any other by the tolerance in the middle of the gap.
    """
    low = exponents[exponents.sum(axis=1) <= GAP_ORDER]
    if len(_near_detunings(eigenvalues, low)) < 2:
        return trivial_resonance(eigenvalues, exponents)
    below, above, gap = _widest_gap(eigenvalues, low)
    kept = _detuning(eigenvalues, low) <= 0.5 * (below + above)
    for table in _named_tables(eigenvalues, low):
        if np.array_equal(table.resonant, kept):
            full = (
                integer_resonance(eigenvalues, exponents, table.internal_resonance)
                if table.internal_resonance
                else trivial_resonance(eigenvalues, exponents)
            )
            return replace(full, reason=f"{full.reason}; {gap}")
    return replace(tolerance_resonance(eigenvalues, exponents, 0.5 * (below + above)), reason=gap)


def gap_resonance(eigenvalues: ComplexArray, exponents: IntArray) -> ResonanceTable:
    """Keep abs(lambda_j - <m, lambda>) < tolerance at every degree, tolerance from the widest gap.

    The tolerance is the geometric mean of the edges of the gap (half the upper edge where the lower is zero): a
    product that is detuned twice as far as the resonance itself then counts as non-resonant, unlike in
    ``automatic_resonance``. The integers are those that all kept terms satisfy, () where there are none.
    """
    low = exponents[exponents.sum(axis=1) <= GAP_ORDER]
    if len(_near_detunings(eigenvalues, low)) < 2:
        return trivial_resonance(eigenvalues, exponents)
    below, above, gap = _widest_gap(eigenvalues, low)
    tolerance = float(np.sqrt(below * above)) if below > 0.0 else 0.5 * above
    table = tolerance_resonance(eigenvalues, exponents, tolerance)
    integers: tuple[int, ...] = ()
    for named in _named_tables(eigenvalues, exponents):
        if not np.any(table.resonant & ~named.resonant):
            integers = named.internal_resonance
            break
    return replace(table, internal_resonance=integers, reason=f"{table.reason}; {gap}")


def _near_detunings(eigenvalues: ComplexArray, low: IntArray) -> FloatArray:
    """Return the different detunings of ``low`` up to the slowest frequency, ascending, rad/s."""
    detuning = _detuning(eigenvalues, low)
    near: FloatArray = np.unique(np.round(detuning[detuning <= eigenvalues.imag.min()], decimals=9))
    return near


def _widest_gap(eigenvalues: ComplexArray, low: IntArray) -> tuple[float, float, str]:
    """Return the edges in rad/s of the widest gap of the frequency detunings of ``low``, and a sentence."""
    steps = _near_detunings(eigenvalues, low)
    widest = int(np.diff(steps).argmax())
    below, above = float(steps[widest]), float(steps[widest + 1])
    return below, above, f"detunings up to {below:.4g} rad/s lie below the widest gap, the next is {above:.4g} rad/s"


def _named_tables(eigenvalues: ComplexArray, exponents: IntArray) -> Iterator[ResonanceTable]:
    yield trivial_resonance(eigenvalues, exponents)
    for integers in product(range(1, LARGEST_INTEGER + 1), repeat=len(eigenvalues)):
        if np.gcd.reduce(integers) == 1:
            yield integer_resonance(eigenvalues, exponents, integers)


def _detuning(eigenvalues: ComplexArray, exponents: IntArray) -> FloatArray:
    omega = eigenvalues.imag
    m = len(omega)
    detuning: FloatArray = np.abs(omega[:, None] - (exponents[:, :m] - exponents[:, m:]) @ omega)
    return detuning
