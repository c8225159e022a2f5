"""Building blocks of the normal form: derivatives, resonances, substitution, conjugacy, sensitivities."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.arrays import ComplexArray
from romgen.chart import ReducedTrajectory
from romgen.conjugacy_residual import ConjugacyProblem, linearise, residual, solve_step
from romgen.differences import first_derivative, resample, second_derivative
from romgen.errors import NumericalError
from romgen.etdrk4 import march
from romgen.manifold import ManifoldFit, lift, nmte_blocks
from romgen.metrics import analytic_signal, instantaneous, nmte_percent
from romgen.polynomial import PolynomialMap, evaluate, exponents
from romgen.reduced_dynamics import decaying_modes, fit_reduced_dynamics
from romgen.resonance import automatic_resonance, integer_resonance, tolerance_resonance
from romgen.substitution import substitute_linear
from romgen.variational import motion, sensitivities

LAMBDA = np.array([-3.2 + 694.1j, -6.5 + 1232.2j])


@pytest.mark.parametrize("derivative", [1, 2])
def test_differences_are_of_order_eight(derivative: int) -> None:
    errors, steps = [], [0.2, 0.1]
    for h in steps:
        t = np.arange(0.0, 4.0, h)
        x = np.sin(2 * t)[:, None]
        exact = (2 * np.cos(2 * t) if derivative == 1 else -4 * np.sin(2 * t))[4:-4, None]
        numeric = first_derivative(x, h) if derivative == 1 else second_derivative(x, h)
        errors.append(np.abs(numeric - exact).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(8.0, abs=0.3)


def test_resampling_of_an_irregular_grid() -> None:
    t = np.cumsum(0.01 + 0.002 * np.random.default_rng(0).random(200))
    uniform, x = resample(t, np.sin(3 * t)[:, None], 0.01)
    # degree 7 spline: error of order (3 * 0.012)^8 = 3e-12 times a constant below 1e2
    assert x[:, 0] == pytest.approx(np.sin(3 * uniform), abs=1e-9)


@pytest.mark.parametrize(("order", "count"), [(3, 3), (5, 10), (7, 22), (9, 40)])
def test_exact_counts_of_one_to_two(order: int, count: int) -> None:
    table = integer_resonance(LAMBDA, exponents(4, 2, order), (1, 2))
    assert table.resonant.sum(axis=1).tolist() == [count, count]


def test_gap_finds_one_to_two_and_no_resonance() -> None:
    assert automatic_resonance(LAMBDA, exponents(4, 2, 5)).internal_resonance == (1, 2)
    apart = automatic_resonance(np.array([-1 + 100j, -1 + 147j]), exponents(4, 2, 5))
    assert apart.internal_resonance == ()
    # z_j times abs(z_1)^2a abs(z_2)^2b of degree 3 and 5: 2 + 3 per row
    assert apart.resonant.sum(axis=1).tolist() == [5, 5]
    assert automatic_resonance(np.array([-1 + 100j]), exponents(2, 2, 5)).resonant.sum() == 2


def test_tolerance_rule_of_the_published_order_five() -> None:
    eigenvalues = np.array([-3.20834 + 694.11858j, -6.47685 + 1232.15362j])
    table = tolerance_resonance(eigenvalues, exponents(4, 2, 5), 30 * 6.47685)
    assert table.resonant.sum(axis=1).tolist() == [9, 9]


def test_substitution_is_exact() -> None:
    rng = np.random.default_rng(1)
    table = exponents(3, 1, 4)
    p = PolynomialMap(table, rng.normal(size=(2, len(table))) + 1j * rng.normal(size=(2, len(table))))
    L = rng.normal(size=(3, 2)) + 1j * rng.normal(size=(3, 2))
    x = rng.normal(size=(5, 2)) + 0j
    assert evaluate(substitute_linear(p, L), x) == pytest.approx(evaluate(p, x @ L.T), rel=1e-11)


def conjugacy_example(n_sample: int = 30) -> tuple[ConjugacyProblem, ComplexArray]:
    rng = np.random.default_rng(2)
    E = exponents(4, 2, 3)
    resonant = integer_resonance(LAMBDA, E, (1, 2)).resonant
    q, q_dot = 0.4 * (rng.normal(size=(2, n_sample, 2)) + 1j * rng.normal(size=(2, n_sample, 2)))
    theta = 0.1 * (rng.normal(size=(2, len(E))) + 1j * rng.normal(size=(2, len(E))))
    return ConjugacyProblem(q, q_dot, LAMBDA / 700, E, resonant), theta


def test_conjugacy_products_match_finite_differences() -> None:
    problem, theta = conjugacy_example()
    here, _ = linearise(problem, theta)
    assert np.allclose(here.r, residual(problem, theta), rtol=1e-13)
    rng = np.random.default_rng(3)
    for direction in (1.0, 1j):
        change = 1e-5 * direction * rng.normal(size=theta.shape)
        slope = 0.5 * (residual(problem, theta + change) - residual(problem, theta - change))
        # central difference: third order in a step of 1e-5
        assert here.forward(change) == pytest.approx(slope, rel=1e-6, abs=1e-6 * np.abs(slope).max())
        weights = rng.normal(size=(*here.r.shape, 2)) @ np.array([1.0, 1j])
        left, right = np.vdot(weights, here.forward(change)).real, np.vdot(here.adjoint(weights), change).real
        assert left == pytest.approx(right * problem.samples, rel=1e-12)


def test_conjugate_gradients_solve_the_normal_equations() -> None:
    problem, theta = conjugacy_example(200)
    here, rows = linearise(problem, 0.1 * theta)
    n = 2 * theta.size
    J = np.empty((2 * problem.samples, n))
    for k in range(n):
        unit = np.zeros(theta.size, dtype=complex)
        unit[k % theta.size] = 1.0 if k < theta.size else 1j
        column = here.forward(unit.reshape(theta.shape)).ravel()
        J[:, k] = np.concatenate([column.real, column.imag])
    weight = 1e-3 * rows.diagonal
    slope = here.adjoint(here.r)
    H = J.T @ J / problem.samples + np.diag(np.tile(weight.ravel(), 2))
    exact = np.linalg.solve(H, np.concatenate([slope.real.ravel(), slope.imag.ravel()]))
    step = solve_step(here, rows, slope, weight, 0.0).ravel()
    # the iteration stops at a relative residual of 1e-4 in the norm of the preconditioner
    assert np.concatenate([step.real, step.imag]) == pytest.approx(exact, abs=1e-3 * np.abs(exact).max())


def test_sensitivities_match_finite_differences() -> None:
    E = np.vstack([np.eye(4, dtype=np.int64)[:2], exponents(4, 2, 3)])
    rng = np.random.default_rng(3)
    C = 5.0 * (rng.normal(size=(2, len(E))) + 1j * rng.normal(size=(2, len(E))))
    C[:, :2] = 0.0
    t, z0 = np.linspace(0, 0.02, 41), np.array([0.3 + 0.1j, -0.2j])
    rows, terms = np.array([0, 1, 0, 1]), np.array([0, 1, 7, 12])
    z, W = sensitivities(t, z0, LAMBDA, (E, C), (rows, terms), 1e-4)
    assert np.array_equal(z, motion(t, z0, LAMBDA, (E, C), 1e-4))

    def change(column: int, unit: complex) -> np.ndarray:
        """dz = W d theta, and what the conjugate of d theta adds through d conj z."""
        dz: np.ndarray = W[:, :2, column] * unit + (W[:, 2:, column] * unit).conj()
        return dz

    for p in range(4):
        for unit in (1.0, 1j):
            step = np.zeros_like(C)
            step[rows[p], terms[p]] = 1e-4 * unit
            ends = [motion(t, z0, LAMBDA, (E, C + sign * step), 1e-4) for sign in (1.0, -1.0)]
            assert change(p, unit) == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-6, abs=1e-10)
    for j in range(2):
        for unit in (1.0, 1j):
            step = 1e-5 * unit * np.eye(2)[j]
            ends = [motion(t, z0 + sign * step, LAMBDA, (E, C), 1e-4) for sign in (1.0, -1.0)]
            assert change(4 + j, unit) == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6, abs=1e-8)


def test_steps_of_fourth_order_through_resonant_terms_as_long_as_the_samples() -> None:
    """Against ETDRK4 in 2^7 finer steps; with terms that turn with their mode one step per sample is nearly exact."""
    E = exponents(4, 2, 3)
    turning = np.array([j == (E @ [1, 2, -1, -2]) for j in (1, 2)])
    rng = np.random.default_rng(4)
    C = 20.0 * (rng.normal(size=turning.shape) + 1j * rng.normal(size=turning.shape)) * turning
    eigenvalues = np.array([-2.0 + 60.0j, -3.0 + 121.0j])
    t, z0 = np.linspace(0.0, 0.4, 33), np.array([0.3 + 0.1j, -0.2j])
    still = np.zeros((32, 2), dtype=complex)
    exact = march(t, z0, eigenvalues, E, C, still, still, 0.0125 / 2**8)
    errors = [np.abs(motion(t, z0, eigenvalues, (E, C), 0.0125 / n) - exact).max() for n in (1, 2, 4)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.4)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.2)
    # a turn of 1.5 rad of the fast mode per step; rates of the nonlinear terms up to 20/s: (20 * 0.0125)^4 / 120
    assert errors[0] < 1e-4


def test_growing_modes_are_refused() -> None:
    with pytest.raises(NumericalError, match="not that of decaying oscillations"):
        decaying_modes(np.array([[0.0, 1.0], [-4.0, 0.1]]))


def test_too_few_samples_for_the_order_are_refused() -> None:
    rng = np.random.default_rng(5)
    y = rng.normal(size=(30, 4))
    few = ReducedTrajectory("few", np.arange(30.0), y, y, y[:, :1], y[:, :1])
    # 125 monomials of degree 1 to 5 in four variables: binomial(9, 4) - 1
    with pytest.raises(NumericalError, match=r"order 5: 30 samples for 125 terms; got condition number"):
        fit_reduced_dynamics([few], 5, 1e-8)


def test_streamed_manifold_recovers_a_polynomial_from_blocks() -> None:
    rng = np.random.default_rng(4)
    E, scale = exponents(2, 1, 3), np.array([1e-3, 2.0])
    W, y = rng.normal(size=(7, len(E))), rng.uniform(-1, 1, size=(300, 2)) * np.array([1e-3, 2.0])
    x = evaluate(PolynomialMap(E, W), y / scale)
    fit = ManifoldFit(7, E, scale)
    for rows in np.array_split(np.arange(300), 4):
        fit.add(x[rows].astype(np.float32), y[rows])
    manifold = fit.finish(0.0)
    # single precision blocks: 6e-8 per entry, averaged over 300 samples
    assert lift(manifold, y) == pytest.approx(x, abs=1e-6 * np.abs(x).max())
    assert nmte_blocks(manifold, x.astype(np.float32), y) < 1e-4
    given = ManifoldFit(7, E, scale, linear=W[:, :2] / scale)
    given.add(x, y)
    assert given.finish(0.0).coefficients == pytest.approx(W, abs=1e-10)


def test_nmte_is_the_mean_distance_over_the_largest_norm() -> None:
    x = np.array([[3.0, 4.0], [0.0, 0.0]])
    assert nmte_percent(x, x + np.array([[0.0, 0.0], [0.0, 1.0]])) == pytest.approx(10.0)


def test_measures_of_a_known_decay() -> None:
    t = np.arange(0, 2, 1e-4)
    x = np.exp(-3 * t) * np.cos(2 * np.pi * 110 * t)
    measured = instantaneous(t, x + 0.3 * np.exp(-5 * t) * np.cos(2 * np.pi * 198 * t), (70.0, 150.0))
    assert measured.frequency_hz == pytest.approx(110.0, rel=2e-3)
    assert np.median(measured.damping_ratio) == pytest.approx(3 / (2 * np.pi * 110), rel=1e-2)
    assert np.abs(analytic_signal(t, np.cos(2 * np.pi * 110 * t), (70, 150)))[5000:-5000] == pytest.approx(1, rel=1e-3)
