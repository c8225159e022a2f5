"""The trained range: hull of the amplitudes that the motions passed through, with its gauge as distance."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.arrays import ComplexArray
from romgen.errors import NumericalError
from romgen.trained_range import GRID_TWO, TrainedRange, box_range, trained_range


def states(seed: int, m: int, n: int = 300) -> ComplexArray:
    rng = np.random.default_rng(seed)
    z: ComplexArray = rng.normal(size=(n, m)) + 1j * rng.normal(size=(n, m))
    return z


def test_two_motions_of_one_mode_each_train_the_line_between_them() -> None:
    z = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 0.5j], [0.0, 0.1]])
    trained = trained_range(z)
    np.testing.assert_allclose(trained.facets, [[0.5, 2.0]], rtol=1e-12)
    np.testing.assert_allclose(trained.distance(np.array([[1.0, 0.25j], [2.0, 0.5]])), [1.0, 2.0], rtol=1e-12)
    np.testing.assert_array_equal(trained.exceeded(np.array([[2.0, 0.0], [2.0, 0.01]])), [False, True])


def test_a_mixed_motion_widens_the_range() -> None:
    alone, mixed = np.array([[2.0, 0.0], [0.0, 0.5]]), np.array([[1.6, 0.4]])
    trained = trained_range(np.vstack([alone, mixed]).astype(complex))
    assert trained.distance(mixed)[0] == pytest.approx(1.0, rel=1e-12)
    assert trained_range(alone.astype(complex)).distance(mixed)[0] == pytest.approx(1.6, rel=1e-12)


@pytest.mark.parametrize("m", [1, 2, 3])
def test_all_samples_lie_inside_and_the_boundary_is_theirs(m: int) -> None:
    z = states(m, m)
    trained = trained_range(z)
    assert not trained.exceeded(z).any()
    np.testing.assert_allclose(trained.amplitude, np.abs(z).max(axis=0), rtol=1e-12)
    assert trained.distance(z).max() == pytest.approx(1.0, rel=1e-9)


def test_rounding_adds_a_grid_step_at_most() -> None:
    """The gauge of the hull itself, by linear programming, over that of the facets: their ratio is 1 + GRID at most."""
    from scipy.optimize import linprog

    z = states(5, 2)
    trained, points = trained_range(z), np.abs(z)
    corners = np.vstack([points * mask for mask in ([1, 1], [1, 0], [0, 1])])
    for probe in np.array([[1.0, 0.2], [0.7, 0.7], [0.1, 1.0]]):
        # smallest d with probe = sum_k c_k corner_k, sum_k c_k = d, c >= 0
        exact = linprog(np.ones(len(corners)), A_eq=corners.T, b_eq=probe).fun
        ratio = exact / trained.distance(probe[None])[0]
        # a point moves by a grid step of each amplitude, at most sqrt(2) grid steps relative to the boundary
        assert 1.0 - 1e-9 <= ratio <= 1.0 + 2.0 * GRID_TWO


@pytest.mark.parametrize("m", [2, 3])
def test_distance_is_homogeneous_and_monotone(m: int) -> None:
    trained = trained_range(states(7, m))
    rng = np.random.default_rng(8)
    rho, more = rng.uniform(size=(50, m)), rng.uniform(size=(50, m))
    np.testing.assert_allclose(trained.distance(3.0 * rho), 3.0 * trained.distance(rho), rtol=1e-12)
    assert np.all(trained.distance(rho + more) >= trained.distance(rho))
    assert np.all(trained.facets >= 0.0)


def test_box_is_the_largest_relative_amplitude() -> None:
    box = box_range(np.array([2.0, 0.5]))
    np.testing.assert_allclose(box.distance(np.array([[1.0, 0.4], [2.0, 0.1]])), [0.8, 1.0])
    np.testing.assert_array_equal(box.amplitude, [2.0, 0.5])


def test_a_lost_state_is_outside_and_does_not_train() -> None:
    z = states(9, 2)
    lost = np.vstack([z, [[np.nan, 0.0]]])
    np.testing.assert_array_equal(trained_range(lost).facets, trained_range(z).facets)
    assert trained_range(z).exceeded(lost)[-1]
    with pytest.raises(NumericalError, match="diverges on all"):
        trained_range(lost[-1:])


def test_a_mode_that_was_never_excited_is_trained_at_rest_only() -> None:
    z = np.array([[1.0, 0.0], [0.5, 0.0]], dtype=complex)
    trained: TrainedRange = trained_range(z)
    np.testing.assert_array_equal(trained.exceeded(np.array([[1.0, 0.0], [0.5, 1e-9]])), [False, True])
