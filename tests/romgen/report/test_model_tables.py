"""Text of the reduced model's tables."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.reduced_model import ReducedModel
from romgen.report import OrderTrial
from romgen.report.model_tables import coefficient_table, detuning, monomial_text, order_table, spectrum_table


def test_monomials_are_written_out() -> None:
    """Powers as superscripts, conjugates with a bar, absent variables absent."""
    assert monomial_text(np.array([2, 0, 0, 1])) == "z₁² z̄₂"
    assert monomial_text(np.array([0, 1, 12, 0])) == "z₂ z̄₁¹²"


def test_detuning_of_the_one_to_two_term(model: ReducedModel) -> None:
    """conj(z1) z2 in row 1: lambda_1 - conj(lambda_1) - lambda_2 = 2i Im(lambda_1) - lambda_2."""
    expected = 2j * model.eigenvalues[0].imag - model.eigenvalues[1]
    assert detuning(model, 0, np.array([0, 1, 1, 0])) == pytest.approx(expected)


def test_only_kept_terms_are_listed(model: ReducedModel) -> None:
    """Three terms in each row; a column of standard errors on request."""
    assert [row[0] for row in coefficient_table(model, None).rows] == ["1", "1", "1", "2", "2", "2"]
    with_errors = coefficient_table(model, np.full(model.normal_form.coefficients.shape, 0.25))
    assert with_errors.header[3] == "standard error [1/s]"
    assert {row[3] for row in with_errors.rows} == {"0.25"}


def test_orders() -> None:
    """The chosen order is named; an order without a stable model is said, not shown as a number."""
    trials = (OrderTrial(3, 4.0, False), OrderTrial(5, 1.5, True), OrderTrial(7, float("inf"), False))
    assert order_table(trials).rows == (("3", "4.000", ""), ("5", "1.500", "chosen"), ("7", "no stable model", ""))


def test_spectrum(model: ReducedModel) -> None:
    """Damping ratio is -Re / abs."""
    first = spectrum_table(model).rows[0]
    assert float(first[4]) == pytest.approx(100 * 2.76 / abs(-2.76 + 689.3j), abs=5e-5)
