"""Monomial tables, values and Jacobians."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from romgen.etdrk4 import zeta_polynomial
from romgen.polynomial import PolynomialMap, evaluate, exponents, jacobian, monomial_rate, monomials, zeta


def test_order_of_the_table() -> None:
    assert exponents(2, 2, 3).tolist() == [[2, 0], [1, 1], [0, 2], [3, 0], [2, 1], [1, 2], [0, 3]]


@pytest.mark.parametrize(("n_var", "order"), [(2, 7), (4, 5), (4, 9), (6, 3)])
def test_number_of_terms(n_var: int, order: int) -> None:
    assert len(exponents(n_var, 1, order)) == comb(n_var + order, order) - 1


def test_empty_range() -> None:
    assert exponents(3, 2, 1).shape == (0, 3)


def test_monomials_are_products_of_powers() -> None:
    x = np.random.default_rng(0).normal(size=(5, 3))
    table = exponents(3, 0, 4)
    expected = np.prod(x[:, None, :] ** table[None], axis=-1)
    assert monomials(x, table) == pytest.approx(expected, rel=1e-13)


def test_jacobian_matches_the_complex_step() -> None:
    rng = np.random.default_rng(2)
    p = PolynomialMap(exponents(3, 1, 5), rng.normal(size=(2, len(exponents(3, 1, 5)))))
    x = rng.normal(size=(4, 3))
    J = jacobian(p, x)
    for i in range(3):
        step = x.astype(complex)
        step[:, i] += 1e-30j
        assert J[:, :, i] == pytest.approx(evaluate(p, step).imag / 1e-30, rel=1e-12)


def test_rate_is_the_chain_rule() -> None:
    rng = np.random.default_rng(3)
    x, x_dot, table = rng.normal(size=(4, 2)), rng.normal(size=(4, 2)), exponents(2, 1, 4)
    step = monomials(x + 1e-30j * x_dot, table).imag / 1e-30
    assert monomial_rate(x, x_dot, table) == pytest.approx(step, rel=1e-12)


def test_compiled_polynomial_is_the_same() -> None:
    rng = np.random.default_rng(4)
    table = exponents(4, 2, 5)
    p = PolynomialMap(table, rng.normal(size=(2, len(table))) + 1j * rng.normal(size=(2, len(table))))
    z = rng.normal(size=2) + 1j * rng.normal(size=2)
    out = np.empty(2, dtype=complex)
    zeta_polynomial(table, p.coefficients, z, np.empty((4, 6), dtype=complex), out)
    assert out == pytest.approx(evaluate(p, zeta(z[None]))[0], rel=1e-12)
