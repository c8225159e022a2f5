"""Anderson acceleration: exact on linear problems, cases independent."""

from __future__ import annotations

import numpy as np

from fem.anderson import Anderson


def _iterate(A: np.ndarray, b: np.ndarray, depth: int, count: int, active: np.ndarray) -> list[np.ndarray]:
    """Residuals f = b - A x of x <- x + accelerated step, from x = 0."""
    n, n_case = b.shape
    anderson, x = Anderson(n, n_case, depth), np.zeros_like(b)
    f = b - A @ x
    residuals = [f]
    for _ in range(count):
        step = anderson.step(active, f)
        x = x + step
        new = b - A @ x
        anderson.remember(active, step, new - f)
        f = new
        residuals.append(f)
    return residuals


def _problem(n: int, n_case: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
    return Q @ np.diag(np.linspace(0.4, 1.6, n)) @ Q.T, rng.standard_normal((n, n_case))


def test_linear_problem_is_solved_in_n_plus_one_steps() -> None:
    """Full depth equals GMRES: n differences span the space, so that step n + 1 lands on the solution."""
    A, b = _problem(5, 3)
    residuals = _iterate(A, b, 5, 6, np.ones(3, dtype=bool))
    # Scaled normal equations with 1e-10 on the diagonal: each step leaves about 1e-10 times their condition number.
    assert np.linalg.norm(residuals[-1]) < 1e-5 * np.linalg.norm(b)
    assert np.linalg.norm(residuals[-2]) > 1e-5 * np.linalg.norm(b)


def test_acceleration_beats_the_plain_iteration() -> None:
    A, b = _problem(60, 1)
    count = 15
    accelerated = np.linalg.norm(_iterate(A, b, 6, count, np.ones(1, dtype=bool))[-1])
    plain = np.linalg.norm(np.linalg.matrix_power(np.eye(60) - A, count) @ b)
    assert accelerated < 0.1 * plain


def test_cases_do_not_mix_and_inactive_ones_rest() -> None:
    A, b = _problem(8, 2)
    both = _iterate(A, b, 4, 5, np.ones(2, dtype=bool))
    first = _iterate(A, b[:, :1].copy(), 4, 5, np.ones(1, dtype=bool))
    np.testing.assert_allclose(both[-1][:, 0], first[-1][:, 0], atol=1e-12)
    alone = _iterate(A, b, 4, 5, np.array([True, False]))
    np.testing.assert_allclose(alone[-1][:, 0], both[-1][:, 0], atol=1e-12)
    np.testing.assert_array_equal(alone[-1][:, 1], b[:, 1])


def test_forget_starts_afresh() -> None:
    A, b = _problem(8, 1)
    anderson, active = Anderson(8, 1, 4), np.ones(1, dtype=bool)
    anderson.remember(active, b, -A @ b)
    assert not np.allclose(anderson.step(active, b), b)
    anderson.forget()
    np.testing.assert_array_equal(anderson.step(active, b), b)


def test_history_older_than_the_depth_is_dropped() -> None:
    """After depth + k pairs only the last depth of them count, whatever their place in the ring."""
    rng = np.random.default_rng(6)
    pairs = [(rng.standard_normal((8, 1)), rng.standard_normal((8, 1))) for _ in range(7)]
    f, active = rng.standard_normal((8, 1)), np.ones(1, dtype=bool)
    long, short = Anderson(8, 1, 3), Anderson(8, 1, 3)
    for pair in pairs:
        long.remember(active, *pair)
    for pair in pairs[-3:]:
        short.remember(active, *pair)
    np.testing.assert_allclose(long.step(active, f), short.step(active, f), atol=1e-9)


def test_step_is_the_least_squares_mixture() -> None:
    rng = np.random.default_rng(7)
    dx, df = rng.standard_normal((10, 3)), rng.standard_normal((10, 3))
    f, active = rng.standard_normal((10, 1)), np.ones(1, dtype=bool)
    anderson = Anderson(10, 1, 3)
    for j in range(3):
        anderson.remember(active, dx[:, j : j + 1].copy(), df[:, j : j + 1].copy())
    gamma = np.linalg.lstsq(df, f, rcond=None)[0]
    # Regularisation 1e-10 of the scaled normal equations, times their condition number of about 10.
    np.testing.assert_allclose(anderson.step(active, f), f - (dx + df) @ gamma, atol=1e-8)
