"""Fixed-step exponential time differencing for z' = Lambda z + N zeta^E + g(t), the scheme of the FMU.

Fourth-order scheme of Cox and Matthews (J. Comput. Phys. 176, 2002, eqs. 26-29) with diagonal Lambda, step h,
c = lambda h, F(z, t) = N zeta^E + g(t), phi_1(c) = (e^c - 1)/c, phi_2(c) = (phi_1(c) - 1)/c and
phi_3(c) = (phi_2(c) - 1/2)/c:

    a  = e^(c/2) z + h/2 phi_1(c/2) F(z, t)
    b  = e^(c/2) z + h/2 phi_1(c/2) F(a, t + h/2)
    d  = e^(c/2) a + h/2 phi_1(c/2) (2 F(b, t + h/2) - F(z, t))
    z+ = e^c z + h [(phi_1 - 3 phi_2 + 4 phi_3) F(z, t) + (2 phi_2 - 4 phi_3) (F(a, t + h/2) + F(b, t + h/2))
                    + (4 phi_3 - phi_2) F(d, t + h)]

The phi functions are Taylor series for abs(c) < 1 and the recursion otherwise. An interval of length H takes
n = max(1, ceil(H/h_max - 1e-9)) steps of h = H/n. The input is g(t) = g_0 + g_1 (t - t_0)/H inside an interval
(g_1 = 0: held; g_1 = next minus this: piecewise linear).
"""

from __future__ import annotations

import math

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.compiled import compiled, compiled_unlocked

# Taylor terms: 1/(20 + 3)! is below the rounding of doubles for abs(c) < 1.
TAYLOR_TERMS = 20


@compiled
def phi_functions(c: complex) -> tuple[complex, complex, complex]:
    """Return phi_1(c), phi_2(c), phi_3(c), phi_k(c) = sum_n c^n / (n + k)!, without cancellation near c = 0."""
    if abs(c) >= 1.0:
        phi_1 = (np.exp(c) - 1.0) / c
        phi_2 = (phi_1 - 1.0) / c
        return phi_1, phi_2, (phi_2 - 0.5) / c
    phi_3 = 0.0 + 0.0j
    for n in range(TAYLOR_TERMS, 0, -1):
        phi_3 = (1.0 + phi_3) * c / (n + 3.0)
    phi_3 = (1.0 + phi_3) / 6.0
    phi_2 = 0.5 + c * phi_3
    return 1.0 + c * phi_2, phi_2, phi_3


@compiled
def step_weights(eigenvalues: ComplexArray, h: float) -> ComplexArray:
    """Return (6, m): e^c, e^(c/2), h/2 phi_1(c/2), and the weights of F(z), of F(a) + F(b), and of F(d)."""
    weights = np.empty((6, eigenvalues.size), dtype=np.complex128)
    for j in range(eigenvalues.size):
        c = eigenvalues[j] * h
        half, _, _ = phi_functions(0.5 * c)
        phi_1, phi_2, phi_3 = phi_functions(c)
        weights[0, j] = np.exp(c)
        weights[1, j] = np.exp(0.5 * c)
        weights[2, j] = 0.5 * h * half
        weights[3, j] = h * (phi_1 - 3.0 * phi_2 + 4.0 * phi_3)
        weights[4, j] = h * (2.0 * phi_2 - 4.0 * phi_3)
        weights[5, j] = h * (4.0 * phi_3 - phi_2)
    return weights


@compiled
def zeta_polynomial(
    exponents: IntArray,
    coefficients: ComplexArray,
    z: ComplexArray,
    powers: ComplexArray,
    out: ComplexArray,
) -> None:
    """Write C zeta^E, zeta = (z, conj z), into ``out`` (n_out,); ``powers`` (2m, max degree + 1) is work space."""
    m, degrees = z.size, powers.shape[1]
    for i in range(m):
        powers[i, 0] = 1.0
        powers[m + i, 0] = 1.0
        for degree in range(1, degrees):
            powers[i, degree] = powers[i, degree - 1] * z[i]
            powers[m + i, degree] = np.conj(powers[i, degree])
    out[:] = 0.0
    for k in range(exponents.shape[0]):
        monomial = 1.0 + 0.0j
        for i in range(2 * m):
            if exponents[k, i] > 0:
                monomial *= powers[i, exponents[k, i]]
        for j in range(out.size):
            out[j] += coefficients[j, k] * monomial


@compiled
def step(
    z: ComplexArray,
    weights: ComplexArray,
    exponents: IntArray,
    coefficients: ComplexArray,
    inputs: ComplexArray,
    powers: ComplexArray,
) -> ComplexArray:
    """Return z after one step; ``inputs`` (3, m) is g at t, t + h/2 and t + h."""
    m = z.size
    f_z, f_a = np.empty(m, dtype=np.complex128), np.empty(m, dtype=np.complex128)
    f_b, f_d = np.empty(m, dtype=np.complex128), np.empty(m, dtype=np.complex128)
    zeta_polynomial(exponents, coefficients, z, powers, f_z)
    f_z += inputs[0]
    a = weights[1] * z + weights[2] * f_z
    zeta_polynomial(exponents, coefficients, a, powers, f_a)
    f_a += inputs[1]
    b = weights[1] * z + weights[2] * f_a
    zeta_polynomial(exponents, coefficients, b, powers, f_b)
    f_b += inputs[1]
    d = weights[1] * a + weights[2] * (2.0 * f_b - f_z)
    zeta_polynomial(exponents, coefficients, d, powers, f_d)
    f_d += inputs[2]
    z_next: ComplexArray = weights[0] * z + weights[3] * f_z + weights[4] * (f_a + f_b) + weights[5] * f_d
    return z_next


@compiled_unlocked
def _march(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    exponents: IntArray,
    coefficients: ComplexArray,
    start: ComplexArray,
    rise: ComplexArray,
    max_step: float,
    degree: int,
) -> ComplexArray:
    m = z0.size
    history = np.empty((t.size, m), dtype=np.complex128)
    powers = np.empty((2 * m, degree + 1), dtype=np.complex128)
    inputs = np.empty((3, m), dtype=np.complex128)
    weights, known = np.empty((6, m), dtype=np.complex128), 0.0
    history[0], z = z0, z0
    for k in range(t.size - 1):
        n = max(1, math.ceil((t[k + 1] - t[k]) / max_step - 1e-9))
        h = (t[k + 1] - t[k]) / n
        if h != known:
            weights, known = step_weights(eigenvalues, h), h
        for i in range(n):
            for stage in range(3):
                inputs[stage] = start[k] + rise[k] * ((i + 0.5 * stage) / n)
            z = step(z, weights, exponents, coefficients, inputs, powers)
        history[k + 1] = z
    return history


def march(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    exponents: IntArray,
    coefficients: ComplexArray,
    start: ComplexArray,
    rise: ComplexArray,
    max_step: float,
) -> ComplexArray:
    """Integrate z' = Lambda z + N zeta^E + g(t) over the intervals of t; a blow-up shows as non-finite rows.

    Parameters
    ----------
    t : (n_time,) s.
    z0 : (m,).
    eigenvalues : (m,) 1/s.
    exponents, coefficients : N as (n_term, 2m) and (m, n_term), 1/s.
    start, rise : (n_time - 1, m) input g at the start of each interval and its change over it, 1/s.
    max_step : h_max, s.

    Returns
    -------
    (n_time, m)
    """
    degree = int(exponents.max(initial=1))
    table, rows = np.ascontiguousarray(exponents), np.ascontiguousarray(coefficients)
    return _march(t, z0, eigenvalues, table, rows, start, rise, max_step, degree)


def largest_step(eigenvalues: ComplexArray) -> float:
    """Return h_max = max(min(1e-4 s, 1/(20 f_max)), 1/(100 f_max)) with f_max = max abs(Im lambda) / 2 pi.

    20 steps per period of the fastest mode, 1e-4 s at most, but never more than 100 per period: a structure of 1 Hz
    would otherwise take 10,000.
    """
    period = 2.0 * np.pi / float(np.abs(eigenvalues.imag).max())
    return max(min(1e-4, period / 20.0), period / 100.0)
