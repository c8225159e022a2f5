"""Missing dissipation: none where energy falls, exact slope, weights that cancel an exchange of energy."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.dissipation import demand, hinge
from romgen.normal_form import resonance_table
from romgen.trained_range import box_range, trained_range

LAMBDA = np.array([-2.0 + 60.0j, -3.0 + 121.0j])
TABLE = resonance_table(LAMBDA, 5, (1, 2))
TRAINED = trained_range(np.array([[0.4, 0.0], [0.0, 0.3]], dtype=complex))
DEMAND = demand(TRAINED, LAMBDA)


def unknowns(B: ComplexArray) -> FloatArray:
    values = np.concatenate([LAMBDA, B[TABLE.resonant]])
    pairs: FloatArray = np.column_stack([values.real, values.imag]).ravel()
    return pairs


def coefficients(terms: dict[tuple[int, ...], tuple[complex, complex]]) -> ComplexArray:
    B = np.zeros(TABLE.resonant.shape, dtype=np.complex128)
    for k, row in enumerate(TABLE.exponents.tolist()):
        B[:, k] = terms.get(tuple(row), (0j, 0j))
    return B


def test_a_linear_decay_lacks_nothing() -> None:
    found = hinge(DEMAND, TABLE.exponents, TABLE.resonant, unknowns(coefficients({})))
    assert found.value.max() == 0.0
    assert np.all(found.slope == 0.0)


def test_negative_damping_is_missing_by_its_amount() -> None:
    """z_1' = .. + 20 abs(z_1)^2 z_1, mode 1 alone at its trained 0.4: r = -1 + 20 0.16 / 2 = 0.6."""
    B = coefficients({(2, 0, 1, 0): (20.0, 0j)})
    found = hinge(DEMAND, TABLE.exponents, TABLE.resonant, unknowns(B))
    alone = np.abs(DEMAND.states[:, 1]) == 0.0
    amplitude = np.abs(DEMAND.states[alone, 0])
    expected = np.maximum(0.0, DEMAND.share[alone] - 1.0 + 10.0 * amplitude**2)
    np.testing.assert_allclose(found.value[alone], expected, rtol=1e-12)
    assert np.count_nonzero(expected) > 0


def test_slope_is_exact() -> None:
    rng = np.random.default_rng(3)
    B = 40.0 * (rng.normal(size=TABLE.resonant.shape) + 1j * rng.normal(size=TABLE.resonant.shape)) * TABLE.resonant
    x = unknowns(B)
    found = hinge(DEMAND, TABLE.exponents, TABLE.resonant, x)
    gradient = 2.0 * found.slope.T @ found.value
    assert np.count_nonzero(found.value) > 10

    def penalty(change: FloatArray) -> float:
        return float(np.sum(hinge(DEMAND, TABLE.exponents, TABLE.resonant, x + change).value ** 2))

    for k in range(len(x)):
        step = np.zeros(len(x))
        step[k] = 1e-4
        # central differences of a sum of squares of hinges, w following; its search stops at 1e-3 of ln w, which the
        # optimum forgives to second order
        difference = (penalty(step) - penalty(-step)) / 2e-4
        assert gradient[k] == pytest.approx(difference, rel=1e-3, abs=1e-3 * np.abs(gradient).max())


def test_weights_cancel_a_conservative_exchange() -> None:
    """z_1' = .. + i p conj(z_1) z_2, z_2' = .. + i q z_1^2 with p, q > 0 keeps q abs(z_1)^2 + p abs(z_2)^2."""
    p, q = 300.0, 300.0
    B = coefficients({(0, 1, 1, 0): (1j * p, 0j), (2, 0, 0, 0): (0j, 1j * q)})
    found = hinge(DEMAND, TABLE.exponents, TABLE.resonant, unknowns(B))
    assert found.value.max() < 1e-2
    # w_j / a_j^2 proportional to q, p
    exact = p * 0.3**2 / (q * 0.4**2)
    assert found.weights[1] / found.weights[0] == pytest.approx(exact, rel=0.05)


def test_states_reach_the_range_and_the_ellipsoid() -> None:
    corner = demand(box_range(np.array([0.4, 0.3])), LAMBDA)
    largest = np.abs(corner.states) / corner.amplitude
    radius = np.maximum(np.linalg.norm(largest, axis=1), largest.max(axis=1))
    # the corner of a box lies outside the ellipsoid
    assert radius.max() > 1.2 * radius[:2].max()
