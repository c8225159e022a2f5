"""Products with mass and constant stiffness against general sparse matrices."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from fem.errors import FemInputError
from fem.linear_operators import LinearOperators


def _matrices(n_node: int) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    rng = np.random.default_rng(3)
    scalar = sp.random(n_node, n_node, 0.3, random_state=rng, format="csr")
    blocks = sp.random(3 * n_node, 3 * n_node, 0.1, random_state=rng, format="csr")
    return sp.kron(scalar, sp.identity(3), format="csr"), blocks


@pytest.mark.parametrize("n_case", [1, 2, 5])
def test_products_are_those_of_the_matrices(n_case: int) -> None:
    mass, stiffness = _matrices(20)
    x = np.random.default_rng(4).standard_normal((60, n_case))
    operators = LinearOperators(mass, stiffness)
    for found, matrix in zip((*operators(x), operators.stiffness(x)), (mass, stiffness, stiffness), strict=True):
        np.testing.assert_allclose(found, matrix @ x, atol=1e-14)


def test_an_empty_stiffness_gives_zero() -> None:
    mass, _ = _matrices(4)
    x = np.ones((12, 2))
    assert not LinearOperators(mass, sp.csr_matrix((12, 12))).stiffness(x).any()


def test_mass_that_differs_by_direction_is_refused() -> None:
    mass, stiffness = _matrices(4)
    with pytest.raises(FemInputError, match="mass must act alike in all directions"):
        LinearOperators((mass + sp.diags(np.arange(12.0))).tocsr(), stiffness)
