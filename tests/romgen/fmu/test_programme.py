"""Monomials as products of earlier ones, and the folding of conjugate pairs."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.fmu.programme import fold_conjugates, monomial_programme
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
