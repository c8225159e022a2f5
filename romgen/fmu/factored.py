"""The maps of a model as the C runtime sums them: monomials as products of a few of half the variables."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.errors import InputError
from romgen.fmu.programme import Exponent, MonomialProgramme, conjugate_programme, monomial_programme
from romgen.fmu.real_chart import real_chart
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel

N_LANE = 4
"""Numbers that processors with AVX add at once; all sum in so many parts, so that all get the same bits."""

N_GROUP = 4
"""Rows that are summed at once: their additions need not wait for one another."""

MAX_MONOMIALS = 60000
"""Monomials are numbered by 16-bit integers in the runtime."""


@dataclass(frozen=True)
class HalvedMap:
    """x_i = sum_b sum_(a < count_b) left_a sum_e C_i(b, a, e) right_(N_LANE b + e).

    left and right are the monomials of the first and of the last m variables.

    Attributes
    ----------
    count : (n_block,) left monomials that a block of N_LANE right ones needs; even, as two are summed apart.
    position : (n_term,) entry of each term in a row of C.
    n_product : products of the programme that are needed.
    """

    count: IntArray = field(metadata={"unit": "1", "axes": "block"})
    position: IntArray = field(metadata={"unit": "1", "axes": "term"})
    n_product: int

    @property
    def n_entry(self) -> int:
        """Length of a row of C, entries of no term included."""
        return N_LANE * int(np.sum(self.count))

    def packed(self, coefficients: FloatArray) -> FloatArray:
        """(n_row n_entry,) in the order of use: by group of rows, then N_LANE entries of each of its rows in turn."""
        C = np.zeros((len(coefficients), self.n_entry))
        C[:, self.position] = coefficients
        groups = np.split(C, range(N_GROUP, len(C), N_GROUP))
        return np.concatenate([rows.reshape(len(rows), -1, N_LANE).swapaxes(0, 1).ravel() for rows in groups])

    def unpacked(self, packed: FloatArray, n_row: int) -> FloatArray:
        """(n_row, n_term) from what ``packed`` made."""
        groups = np.split(packed, self.n_entry * np.arange(N_GROUP, n_row, N_GROUP))
        rows = [group.reshape(self.n_entry // N_LANE, -1, N_LANE).swapaxes(0, 1) for group in groups]
        return np.concatenate([group.reshape(-1, self.n_entry) for group in rows])[:, self.position]


@dataclass(frozen=True)
class GroupedForm:
    """N_j = sum over its groups of base P(abs(z_1)^2, ..), the pairs z_k conj z_k of each monomial taken out.

    Attributes
    ----------
    base : monomials of (z_1..z_m, conj z_1..conj z_m) without pairs (``conjugate_programme``).
    rows : for each N_j its groups, (position of the base, number of coefficients of P).
    coefficients : those of all P, over the first monomials of m variables.
    n_product : products of these that are needed.
    """

    base: MonomialProgramme
    rows: tuple[tuple[tuple[int, int], ...], ...]
    coefficients: ComplexArray = field(metadata={"unit": "1/s", "axes": "term"})
    n_product: int


@dataclass(frozen=True)
class FactoredModel:
    """Normal form, chart and sensors (displacements, then velocities) over monomials of m variables.

    Attributes
    ----------
    half : the monomials of m variables.
    """

    half: MonomialProgramme
    form: GroupedForm
    chart: HalvedMap
    sensor: HalvedMap
    chart_map: PolynomialMap[np.float64]
    sensor_map: PolynomialMap[np.float64]


def factored_model(model: ReducedModel) -> FactoredModel:
    """Take the maps of a model apart.

    Raises
    ------
    InputError : a constant term, or more monomials than the runtime can number.
    """
    m = len(model.eigenvalues)
    chart, sensor = real_chart(model.chart), sensor_map(model)
    resonant = model.normal_form.exponents.reshape(-1, 2 * m)
    squares, bases = _pairs_taken_out(resonant)
    halves = [part for p in (chart, sensor) for part in (p.exponents[:, :m], p.exponents[:, m:])]
    half, base = monomial_programme(np.vstack([squares, *halves])), conjugate_programme(bases)
    for exponents in (resonant, chart.exponents, sensor.exponents):
        if np.any(np.sum(exponents, axis=1) == 0):
            raise InputError(
                "a polynomial has a constant term", where="FMU export", advice="shift the model to its rest state"
            )
    largest = max(half.n_monomial, base.n_monomial)
    if largest > MAX_MONOMIALS:
        raise InputError("a map has too many monomials", where="FMU export", value=largest, advice="lower the order")
    form = _grouped(model.normal_form.coefficients, (squares, bases), half, base)
    return FactoredModel(half, form, _halved(chart.exponents, half), _halved(sensor.exponents, half), chart, sensor)


def sensor_map(model: ReducedModel) -> PolynomialMap[np.float64]:
    """Displacements and velocities over the exponents of both."""
    maps = (model.displacement, model.velocity)
    rows = sorted({tuple(row) for p in maps for row in p.exponents.tolist()}, key=lambda e: (sum(e), e))
    column = {row: k for k, row in enumerate(rows)}
    n = len(model.sensors)
    W = np.zeros((2 * n, len(rows)))
    for first, p in zip((0, n), maps, strict=True):
        for row, w in zip(p.exponents.tolist(), p.coefficients.T, strict=True):
            W[first : first + n, column[tuple(row)]] += w
    return PolynomialMap(np.array(rows, dtype=np.int64).reshape(-1, model.displacement.exponents.shape[1]), W)


def _pairs_taken_out(exponents: IntArray) -> tuple[IntArray, IntArray]:
    """Exponents of abs(z_k)^2, (n_term, m), and what is left, (n_term, 2m)."""
    m = exponents.shape[1] // 2
    squares = np.minimum(exponents[:, :m], exponents[:, m:])
    return squares, exponents - np.hstack([squares, squares])


def _grouped(
    coefficients: ComplexArray, parts: tuple[IntArray, IntArray], half: MonomialProgramme, base: MonomialProgramme
) -> GroupedForm:
    square, left_over = (_positions(p, e) for p, e in zip((half, base), parts, strict=True))
    rows, polynomials = [], []
    for c in coefficients:
        used = np.flatnonzero(c)
        row = []
        for position in np.unique(left_over[used]):
            terms = used[left_over[used] == position]
            P = np.zeros(int(np.max(square[terms])) + 1, dtype=np.complex128)
            P[square[terms]] = c[terms]
            row.append((int(position), len(P)))
            polynomials.append(P)
        rows.append(tuple(row))
    longest = max((len(P) for P in polynomials), default=1)
    joined = np.concatenate([np.zeros(0, dtype=np.complex128), *polynomials])
    return GroupedForm(base, tuple(rows), joined, max(0, longest - 1 - half.n_var))


def _halved(exponents: IntArray, half: MonomialProgramme) -> HalvedMap:
    m = half.n_var
    left, right = _positions(half, exponents[:, :m]), _positions(half, exponents[:, m:])
    block, lane = np.divmod(right, N_LANE)
    count = np.zeros(int(np.max(block)) + 1, dtype=np.int64)
    np.maximum.at(count, block, left + 1)
    count += count % 2
    start = N_LANE * (np.cumsum(count) - count)
    last = max(int(np.max(left)), N_LANE * len(count) - 1)  # whole blocks are multiplied
    return HalvedMap(count, start[block] + N_LANE * left + lane, max(0, min(last, half.n_monomial - 1) - m))


def _positions(programme: MonomialProgramme, exponents: IntArray) -> IntArray:
    rows: Iterable[Exponent] = map(tuple, exponents.tolist())
    return np.array([programme.index[row] for row in rows], dtype=np.int64)
