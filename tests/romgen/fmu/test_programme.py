"""Monomials as products of earlier ones, and the folding of conjugate pairs."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.fmu.programme import complex_programme, fold_conjugates, monomial_programme
from romgen.polynomial import evaluate, exponents, monomials, zeta
from romgen.reduced_model import ReducedModel
from tests.romgen.fmu.models import random_states


@pytest.mark.parametrize("table", [exponents(4, 1, 7), np.array([[2, 1, 0, 0], [0, 0, 3, 2], [1, 0, 0, 1]])])
def test_each_monomial_is_one_product_of_earlier_ones(table: np.ndarray) -> None:
    programme = monomial_programme(table)
    x = np.random.default_rng(0).uniform(-1.5, 1.5, 4)
    values = list(x)
    for left, right in programme.products:
        assert left < len(values)
        assert right < len(values)
        values.append(values[left] * values[right])
    position = [programme.index[tuple(row)] for row in table]
    # At most 7 factors, each product rounds once: 8 units in the last place.
    np.testing.assert_allclose(np.array(values)[position], monomials(x[None], table)[0], rtol=8 * np.finfo(float).eps)


@pytest.mark.parametrize(
    "table", [exponents(4, 1, 7), np.array([[2, 1, 3, 0], [0, 4, 1, 2], [1, 1, 1, 1], [1, 0, 1, 0]])]
)
def test_complex_monomials_take_their_pairs_out(table: np.ndarray) -> None:
    """Products hold no variable with its own conjugate, but for the pair itself; the rest is times a real number."""
    programme = complex_programme(table)
    rng = np.random.default_rng(1)
    z = rng.uniform(-1.0, 1.0, 2) + 1j * rng.uniform(-1.0, 1.0, 2)
    values = [*z, *z.conj()]
    for left, right in programme.products:
        values.append(values[left] * values[right])
    for left, mode in programme.pairs:
        values.append(values[left] * abs(z[mode]) ** 2)
    assert len(values) == programme.n_monomial
    position = [programme.index[tuple(row)] for row in table]
    expected = monomials(np.array([[*z, *z.conj()]]), table)[0]
    # At most 8 factors; a complex product is off by sqrt(5) units of rounding (Brent, Percival, Zimmermann 2007).
    np.testing.assert_allclose(np.array(values)[position], expected, rtol=8 * np.sqrt(5.0) * np.finfo(float).eps)
    bare = [row for row, k in programme.index.items() if k < 4 + len(programme.products) and sum(row) > 2]
    assert not any(row[j] and row[2 + j] for row in bare for j in range(2))


def test_products_of_a_full_table_come_in_few_runs() -> None:
    """One run for each variable and degree from 2 on: all that they read lies before what they write."""
    programme = monomial_programme(exponents(4, 1, 7))
    assert len(programme.runs) == 4 * 6
    position = 4
    for left, factor, count in programme.runs:
        assert left + count <= position
        assert factor < 4
        position += count
    assert position == programme.n_monomial


@pytest.mark.parametrize(
    "table", [np.array([[0, 1], [0, 5]]), np.array([[0, 0, 0, 1], [0, 0, 0, 7], [1, 0, 0, 2]]), exponents(4, 1, 5)[::3]]
)
def test_runs_of_a_sparse_table_read_nothing_that_they_write(table: np.ndarray) -> None:
    """The runtime may compute all products of a run at once; powers of the last variable follow each other too."""
    programme = monomial_programme(table)
    x = np.random.default_rng(2).uniform(-1.5, 1.5, table.shape[1])
    values = x
    for left, factor, count in programme.runs:
        read = values[left : left + count]
        assert len(read) == count
        values = np.concatenate([values, read * values[factor]])
    position = [programme.index[tuple(row)] for row in table]
    # At most 7 factors, each product rounds once.
    np.testing.assert_allclose(values[position], monomials(x[None], table)[0], rtol=8 * np.finfo(float).eps)


def test_a_full_table_needs_no_extra_monomials() -> None:
    table = exponents(4, 1, 7)
    assert monomial_programme(table).n_monomial == len(table)


def test_a_constant_term_is_refused() -> None:
    with pytest.raises(InputError, match="constant term"):
        monomial_programme(np.array([[0, 0], [1, 0]]))


def test_folding_keeps_the_real_part_and_halves_the_terms(model: ReducedModel) -> None:
    folded = fold_conjugates(model.chart)
    z = random_states(model, 50)
    expected = evaluate(model.chart, zeta(z)).real
    scale = np.abs(model.chart.coefficients).sum()
    np.testing.assert_allclose(evaluate(folded, zeta(z)).real, expected, atol=4 * np.finfo(float).eps * scale, rtol=0.0)
    self_conjugate = np.all(model.chart.exponents[:, :2] == model.chart.exponents[:, 2:], axis=1).sum()
    assert len(folded.exponents) == (len(model.chart.exponents) + self_conjugate) // 2
