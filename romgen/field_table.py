"""Polynomials of zeta = (z, conj z) as a plan of products: each monomial is an earlier one times one variable."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from romgen.arrays import ComplexArray, IntArray
from romgen.compiled import compiled, compiled_unlocked


class MonomialPlan(NamedTuple):
    """Order in which monomials are made; a named tuple, as compiled loops read it.

    Attributes
    ----------
    parent, variable : (n_monomial,) monomial q is monomial ``parent`` times zeta ``variable``; 0 is the constant 1.
    term : (n_term,) monomial of each row of E.
    lowered : (n_term, 2m) monomial of each row with one power of a variable less; -1 where there is none.
    """

    parent: IntArray
    variable: IntArray
    term: IntArray
    lowered: IntArray


class FieldTable(NamedTuple):
    """How a polynomial C zeta^E and its slopes are summed from monomials.

    Attributes
    ----------
    parent, variable : of the plan.
    rows, values, coefficients : (n_value,) row, monomial and coefficient of C zeta^E, zeros left out.
    slope_rows, slope_values, slope_coefficients : (n_slope,) the same of d(C zeta^E)_j / d zeta_i, row j 2m + i.
    """

    parent: IntArray
    variable: IntArray
    rows: IntArray
    values: IntArray
    coefficients: ComplexArray
    slope_rows: IntArray
    slope_values: IntArray
    slope_coefficients: ComplexArray


def monomial_plan(E: IntArray, *, slopes: bool = False) -> MonomialPlan:
    """Return the plan of the rows of E (n_term, 2m), with all that slopes need where they are wanted."""
    return _plan(E.shape, np.ascontiguousarray(E, dtype=np.int64).tobytes(), slopes)


@lru_cache(maxsize=64)
def _plan(shape: tuple[int, int], data: bytes, slopes: bool) -> MonomialPlan:
    E = np.frombuffer(data, dtype=np.int64).reshape(shape)
    number, parent, variable = {(0,) * shape[1]: 0}, [0], [0]

    def monomial(powers: tuple[int, ...]) -> int:
        if powers not in number:
            i = next(i for i, power in enumerate(powers) if power)
            before = monomial((*powers[:i], powers[i] - 1, *powers[i + 1 :]))
            number[powers] = len(parent)
            parent.append(before)
            variable.append(i)
        return number[powers]

    term = np.array([monomial(tuple(row)) for row in E.tolist()], dtype=np.int64)
    lowered = np.full(shape, -1, dtype=np.int64)
    if slopes:
        for k, i in zip(*np.nonzero(E), strict=True):
            fewer = E[k].copy()
            fewer[i] -= 1
            lowered[k, i] = monomial(tuple(fewer.tolist()))
    return MonomialPlan(np.array(parent), np.array(variable), term, lowered)


def field_table(E: IntArray, C: ComplexArray, *, slopes: bool) -> FieldTable:
    """Return the table of C zeta^E for E (n_term, 2m) and C (m, n_term), with its slopes where they are wanted."""
    plan = monomial_plan(E, slopes=slopes)
    rows, terms = np.nonzero(C)
    entry, variable = np.nonzero(plan.lowered[terms] >= 0)
    slope_rows, slope_terms = rows[entry], terms[entry]
    return FieldTable(
        parent=plan.parent,
        variable=plan.variable,
        rows=rows,
        values=plan.term[terms],
        coefficients=C[rows, terms],
        slope_rows=slope_rows * E.shape[1] + variable,
        slope_values=plan.lowered[slope_terms, variable],
        slope_coefficients=C[slope_rows, slope_terms] * E[slope_terms, variable],
    )


@compiled
def fill_monomials(zeta: ComplexArray, parent: IntArray, variable: IntArray, phi: ComplexArray) -> None:
    """Write all monomials of zeta (2m,) into ``phi`` (n_monomial,)."""
    phi[0] = 1.0
    for q in range(1, parent.size):
        phi[q] = phi[parent[q]] * zeta[variable[q]]


@compiled
def sum_terms(
    phi: ComplexArray, rows: IntArray, values: IntArray, coefficients: ComplexArray, out: ComplexArray
) -> None:
    """Write sum_q coefficients_q phi[values_q] of each row into ``out``."""
    out[:] = 0.0
    for q in range(rows.size):
        out[rows[q]] += coefficients[q] * phi[values[q]]


@compiled_unlocked
def _evaluate(table: FieldTable, zeta: ComplexArray, n_row: int) -> tuple[ComplexArray, ComplexArray]:
    n, n_var = zeta.shape
    values = np.empty((n, n_row), dtype=np.complex128)
    slopes = np.empty((n, n_row * n_var), dtype=np.complex128)
    phi = np.empty(table.parent.size, dtype=np.complex128)
    for k in range(n):
        fill_monomials(zeta[k], table.parent, table.variable, phi)
        sum_terms(phi, table.rows, table.values, table.coefficients, values[k])
        sum_terms(phi, table.slope_rows, table.slope_values, table.slope_coefficients, slopes[k])
    return values, slopes


def real_map(E: IntArray, C: ComplexArray, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return x (n, n_row) = C zeta^E and s (n, n_row, m) with d Re x_j = Re(sum_i s_ji dz_i), conjugate part folded in.

    Parameters
    ----------
    E : (n_term, 2m); C : (n_row, n_term); z : (n, m).
    """
    m = z.shape[1]
    values, slopes = _evaluate(field_table(E, C, slopes=True), np.hstack([z, z.conj()]), len(C))
    s = slopes.reshape(len(z), len(C), 2 * m)
    folded: ComplexArray = s[:, :, :m] + s[:, :, m:].conj()
    return values, folded
