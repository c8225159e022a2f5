"""Anderson acceleration: exact on linear problems, cases independent."""

from __future__ import annotations

import numpy as np

from fem.anderson import Anderson


def _iterate(A: np.ndarray, b: np.ndarray, depth: int, count: int) -> list[np.ndarray]:
    """Residuals f = b - A x of x <- x + accelerated step, from x = 0."""
    n, n_case = b.shape
    anderson, x, live = Anderson(n, n_case, depth), np.zeros_like(b), np.arange(n_case)
    f = b - A @ x
    residuals = [f]
    for _ in range(count):
        step = anderson.step(live, f)
        x = x + step
        new = b - A @ x
        anderson.remember(live, step, new - f)
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
    residuals = _iterate(A, b, 5, 6)
    # Scaled normal equations with 1e-10 on the diagonal: each step leaves about 1e-10 times their condition number.
    assert np.linalg.norm(residuals[-1]) < 1e-5 * np.linalg.norm(b)
    assert np.linalg.norm(residuals[-2]) > 1e-5 * np.linalg.norm(b)


def test_acceleration_beats_the_plain_iteration() -> None:
    A, b = _problem(60, 1)
    count = 15
    accelerated = np.linalg.norm(_iterate(A, b, 6, count)[-1])
    plain = np.linalg.norm(np.linalg.matrix_power(np.eye(60) - A, count) @ b)
    assert accelerated < 0.1 * plain


def test_cases_do_not_mix_and_may_leave() -> None:
    A, b = _problem(8, 2)
    both = _iterate(A, b, 4, 5)
    first = _iterate(A, b[:, :1].copy(), 4, 5)
    np.testing.assert_allclose(both[-1][:, 0], first[-1][:, 0], atol=1e-12)
    anderson, f = Anderson(8, 2, 4), np.random.default_rng(6).standard_normal((8, 2))
    anderson.remember(np.arange(2), b, A @ b)
    together = anderson.step(np.arange(2), f)
    for case in range(2):
        column = slice(case, case + 1)
        alone = anderson.step(np.array([case]), np.ascontiguousarray(f[:, column]))
        np.testing.assert_allclose(alone, together[:, column], rtol=1e-12)


def test_forget_starts_afresh() -> None:
    A, b = _problem(8, 1)
    anderson, live = Anderson(8, 1, 4), np.arange(1)
    anderson.remember(live, b, -A @ b)
    assert not np.allclose(anderson.step(live, b), b)
    anderson.forget()
    np.testing.assert_array_equal(anderson.step(live, b), b)


def test_history_older_than_the_depth_is_dropped() -> None:
    """After depth + k pairs only the last depth of them count, whatever their place in the ring."""
    rng = np.random.default_rng(6)
    pairs = [(rng.standard_normal((8, 1)), rng.standard_normal((8, 1))) for _ in range(7)]
    f, live = rng.standard_normal((8, 1)), np.arange(1)
    long, short = Anderson(8, 1, 3), Anderson(8, 1, 3)
    for pair in pairs:
        long.remember(live, *pair)
    for pair in pairs[-3:]:
        short.remember(live, *pair)
    np.testing.assert_allclose(long.step(live, f), short.step(live, f), atol=1e-9)


def test_step_is_the_least_squares_mixture() -> None:
    rng = np.random.default_rng(7)
    dx, df = rng.standard_normal((10, 3)), rng.standard_normal((10, 3))
    f, live = rng.standard_normal((10, 1)), np.arange(1)
    anderson = Anderson(10, 1, 3)
    for j in range(3):
        anderson.remember(live, dx[:, j : j + 1].copy(), df[:, j : j + 1].copy())
    gamma = np.linalg.lstsq(df, f, rcond=None)[0]
    # Regularisation 1e-10 of the scaled normal equations, times their condition number of about 10.
    np.testing.assert_allclose(anderson.step(live, f), f - (dx + df) @ gamma, atol=1e-8)
