"""Monomials as products of earlier ones, and the folding of conjugate pairs."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.fmu.programme import conjugate_programme, fold_conjugates, monomial_programme
from romgen.polynomial import evaluate, exponents, monomials, zeta
from romgen.reduced_model import ReducedModel
from tests.romgen.fmu.models import random_states

TABLES = [exponents(4, 1, 7), np.array([[2, 1, 0, 0], [0, 0, 3, 2], [0, 0, 0, 0], [1, 0, 0, 1], [0, 9, 0, 0]])]


@pytest.mark.parametrize("table", TABLES)
def test_each_monomial_is_one_product_of_earlier_ones(table: np.ndarray) -> None:
    programme = monomial_programme(table)
    x = np.random.default_rng(0).uniform(-1.5, 1.5, 4)
    values = [1.0, *x]
    for left, right in programme.products:
        assert max(left, right) < len(values)
        values.append(values[left] * values[right])
    assert len(values) == programme.n_monomial
    position = [programme.index[tuple(row)] for row in table]
    # At most 9 factors, each product rounds once.
    np.testing.assert_allclose(np.array(values)[position], monomials(x[None], table)[0], rtol=9 * np.finfo(float).eps)


@pytest.mark.parametrize("table", TABLES)
def test_few_products_wait_for_one_another(table: np.ndarray) -> None:
    """A product of degree d is ready after ceil(log2 d) others; low degrees come first."""
    programme = monomial_programme(table)
    ready, degree = [0] * 5, [0, *[1] * 4]
    for left, right in programme.products:
        ready.append(1 + max(ready[left], ready[right]))
        degree.append(degree[left] + degree[right])
    assert ready == [int(np.ceil(np.log2(max(1, d)))) for d in degree]
    assert degree == sorted(degree)


def test_a_full_table_needs_no_extra_monomials() -> None:
    table = exponents(4, 1, 7)
    assert monomial_programme(table).n_monomial == 1 + len(table)


RESONANT = np.array([[0, 1, 1, 0], [2, 0, 0, 0], [3, 0, 0, 1], [0, 2, 2, 0], [0, 2, 3, 0], [5, 0, 0, 2], [0, 3, 4, 0]])


@pytest.mark.parametrize("table", [RESONANT, np.array([[0, 0, 3, 2], [1, 0, 0, 6], [0, 0, 0, 0]]), RESONANT[:0]])
def test_monomials_with_their_conjugates(table: np.ndarray) -> None:
    programme = conjugate_programme(table)
    rng = np.random.default_rng(1)
    z = rng.uniform(-1.0, 1.0, 2) + 1j * rng.uniform(-1.0, 1.0, 2)
    values = [1.0, 1.0, z[0], z[0].conj(), z[1], z[1].conj()]
    for left, right in programme.products:
        assert max(left, right) < len(values)
        product = values[left] * values[right]
        values += [product, product.conj()]
    assert len(values) == 1 + programme.n_monomial
    expected = monomials(np.array([[*z, *z.conj()]]), np.array(list(programme.index)))[0]
    # At most 7 factors; a complex product is off by sqrt(5) units of rounding (Brent, Percival, Zimmermann 2007).
    limit = 7 * np.sqrt(5.0) * np.finfo(float).eps
    np.testing.assert_allclose(np.array(values)[list(programme.index.values())], expected, rtol=limit)
    assert set(map(tuple, table.tolist())) <= set(programme.index)


def test_resonant_monomials_need_no_others() -> None:
    """Those of a 1:2 resonance are products of one another and their conjugates."""
    assert len(conjugate_programme(RESONANT).products) == len(RESONANT)


def test_folding_keeps_the_real_part_and_halves_the_terms(model: ReducedModel) -> None:
    folded = fold_conjugates(model.chart)
    z = random_states(model, 50)
    expected = evaluate(model.chart, zeta(z)).real
    scale = np.abs(model.chart.coefficients).sum()
    np.testing.assert_allclose(evaluate(folded, zeta(z)).real, expected, atol=4 * np.finfo(float).eps * scale, rtol=0.0)
    self_conjugate = np.all(model.chart.exponents[:, :2] == model.chart.exponents[:, 2:], axis=1).sum()
    assert len(folded.exponents) == (len(model.chart.exponents) + self_conjugate) // 2
    again = fold_conjugates(folded)
    np.testing.assert_array_equal(again.exponents, folded.exponents)
    np.testing.assert_array_equal(again.coefficients, folded.coefficients)
