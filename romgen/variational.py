"""Trajectories of a normal form together with their sensitivities to coefficients and initial state.

Classical Runge-Kutta steps in the rotating coordinates exp(-Lambda t) z (Lawson 1967), c = Lambda h, F = C zeta^E:

    a = e^(c/2) (z + h/2 F(z)),   b = e^(c/2) z + h/2 F(a),   d = e^c z + h e^(c/2) F(b)
    z+ = e^c z + h/6 (e^c F(z) + 2 e^(c/2) (F(a) + F(b)) + F(d)).

Resonant terms turn with their mode, so in these coordinates they vary only with the amplitudes and with their detuning:
a step can be a good part of a period, where ETDRK4 (the scheme of the FMU, see ``etdrk4``) takes many.

Every column of W = d zeta / d theta, zeta = (z, conj z), theta a complex coefficient or initial state and
d zeta = W d theta + (its conjugate, halves exchanged), follows the same linear equation. One step is therefore

    W+ = A W + sum_s U_s f_s,    f_s = d F / d theta at stage s = z, a, b, d,

A and U_s (2m, 2m) from the slopes N_s of F at the stages. They are formed once per step for all columns; the derivative
is exactly that of the numerical solution. A coefficient of row r and term k has f = e_r zeta^E_k. The lower half of
every matrix follows from the upper one by conjugation.
"""

from __future__ import annotations

import math

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.compiled import compiled, compiled_unlocked
from romgen.field_table import FieldTable, field_table, fill_monomials, monomial_plan, sum_terms

BLOW_UP = 1e3


@compiled
def _mirrored(top: ComplexArray, out: ComplexArray) -> None:
    """Write the (2m, 2m) matrix whose upper half is ``top`` (m, 2m); the lower one acts on conj z alike."""
    m = top.shape[0]
    for j in range(m):
        for i in range(2 * m):
            out[j, i] = top[j, i]
            out[m + j, (m + i) % (2 * m)] = np.conj(top[j, i])


@compiled
def _product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return the product of two small matrices, in a fixed order of summation."""
    out = np.zeros((left.shape[0], right.shape[1]), dtype=np.complex128)
    for j in range(left.shape[0]):
        for k in range(left.shape[1]):
            for i in range(right.shape[1]):
                out[j, i] += left[j, k] * right[k, i]
    return out


@compiled
def _step_matrices(w: ComplexArray, h: float, N: ComplexArray, A: ComplexArray, U: ComplexArray) -> None:
    """Write A and U (4, 2m, 2m) of one step from w = (e^c, e^(c/2)), (2, 2m), and N (4, 2m, 2m) at the stages."""
    n = w.shape[1]
    m = n // 2
    top = np.zeros((4, m, n), dtype=np.complex128)
    G_d = h / 6.0 * N[3, :m]
    for j in range(m):
        for i in range(n):
            top[2, j, i] = h * G_d[j, i] * w[1, i]
        top[2, j, j] += h / 3.0 * w[1, j]
        U[3, j, j] = U[3, m + j, m + j] = h / 6.0
    G_b = _product(top[2], N[2])
    top[1] = 0.5 * h * G_b
    for j in range(m):
        top[1, j, j] += h / 3.0 * w[1, j]
    G_a = _product(top[1], N[1])
    for j in range(m):
        for i in range(n):
            top[0, j, i] = 0.5 * h * G_a[j, i] * w[1, i]
        top[0, j, j] += h / 6.0 * w[0, j]
    own = _product(top[0], N[0])
    for j in range(m):
        for i in range(n):
            own[j, i] += G_d[j, i] * w[0, i] + (G_b[j, i] + G_a[j, i]) * w[1, i]
        own[j, j] += w[0, j]
    _mirrored(own, A)
    for s in range(3):
        _mirrored(top[s], U[s])


@compiled
def _stage(table: FieldTable, y: ComplexArray, phi: ComplexArray, F: ComplexArray, N: ComplexArray) -> None:
    """Write monomials, field (m,) and slopes (2m, 2m) at the state y (2m,)."""
    fill_monomials(y, table.parent, table.variable, phi)
    sum_terms(phi, table.rows, table.values, table.coefficients, F)
    if N.size == 0:
        return
    m, n = F.size, y.size
    top = np.empty(m * n, dtype=np.complex128)
    sum_terms(phi, table.slope_rows, table.slope_values, table.slope_coefficients, top)
    _mirrored(top.reshape(m, n), N)


@compiled
def _mirror(y: ComplexArray) -> None:
    """Write conj z into the lower half of y = (z, conj z)."""
    m = y.size // 2
    for j in range(m):
        y[m + j] = np.conj(y[j])


@compiled
def _step(table: FieldTable, w: ComplexArray, h: float, y: ComplexArray, phi: ComplexArray, N: ComplexArray) -> None:
    """Advance y (2m,) by one step; writes the monomials phi (4, n_monomial) and slopes N (4, 2m, 2m) of the stages."""
    m = y.size // 2
    F, x = np.empty((4, m), dtype=np.complex128), np.empty(2 * m, dtype=np.complex128)
    _stage(table, y, phi[0], F[0], N[0])
    for j in range(m):
        x[j] = w[1, j] * (y[j] + 0.5 * h * F[0, j])
    _mirror(x)
    _stage(table, x, phi[1], F[1], N[1])
    for j in range(m):
        x[j] = w[1, j] * y[j] + 0.5 * h * F[1, j]
    _mirror(x)
    _stage(table, x, phi[2], F[2], N[2])
    for j in range(m):
        x[j] = w[0, j] * y[j] + h * w[1, j] * F[2, j]
    _mirror(x)
    _stage(table, x, phi[3], F[3], N[3])
    for j in range(m):
        turned = w[0, j] * F[0, j] + 2.0 * w[1, j] * (F[1, j] + F[2, j]) + F[3, j]
        y[j] = w[0, j] * y[j] + h / 6.0 * turned
    _mirror(y)


@compiled
def _advance(A: ComplexArray, U: ComplexArray, f: FloatArray, runs: IntArray, old: FloatArray, new: FloatArray) -> None:
    """Write A W + sum_s U_s f_s, real and imaginary parts apart, which become vector instructions.

    f (4, 2, n_parameter) are the monomials of the columns at the stages; ``runs`` (row, first, last) are columns of
    equal row r, whose source is e_r f.
    """
    n, n_column = new.shape[1:]
    new[:] = 0.0
    for i in range(n):
        for k in range(n):
            _add_multiple(A[i, k], old[:, k], new[:, i], 0, n_column)
        for run in range(runs.shape[0]):
            for s in range(4):
                _add_multiple(U[s, i, runs[run, 0]], f[s], new[:, i], runs[run, 1], runs[run, 2])


@compiled
def _add_multiple(factor: complex, x: FloatArray, out: FloatArray, first: int, last: int) -> None:
    """Add factor times x to ``out`` in the columns first..last - 1; row 0 real parts, row 1 imaginary parts."""
    a, b = factor.real, factor.imag
    for c in range(first, last):
        out[0, c] += a * x[0, c] - b * x[1, c]
        out[1, c] += a * x[1, c] + b * x[0, c]


@compiled
def _sources(phi: ComplexArray, monomial: IntArray, f: FloatArray) -> None:
    """Write the monomials of the columns (n_parameter,) at the four stages into f (4, 2, n_parameter)."""
    for s in range(4):
        for c in range(monomial.size):
            f[s, 0, c] = phi[s, monomial[c]].real
            f[s, 1, c] = phi[s, monomial[c]].imag


@compiled
def _weights(eigenvalues: ComplexArray, h: float) -> ComplexArray:
    """Return e^c and e^(c/2) for (Lambda, conj Lambda), (2, 2m)."""
    both = np.concatenate((eigenvalues, np.conj(eigenvalues)))
    w = np.empty((2, both.size), dtype=np.complex128)
    w[0], w[1] = np.exp(h * both), np.exp(0.5 * h * both)
    return w


@compiled_unlocked
def _march_states(
    t: FloatArray, z0: ComplexArray, eigenvalues: ComplexArray, table: FieldTable, max_step: float
) -> ComplexArray:
    m = z0.size
    states = np.full((t.size, m), np.nan + 0j)
    phi, N = np.empty((4, table.parent.size), dtype=np.complex128), np.empty((4, 0, 0), dtype=np.complex128)
    y, known, w = np.concatenate((z0, np.conj(z0))), 0.0, _weights(eigenvalues, 1.0)
    for k in range(t.size):
        states[k] = y[:m]
        if k + 1 == t.size or not np.abs(y).max() <= BLOW_UP:
            break
        steps = max(1, math.ceil((t[k + 1] - t[k]) / max_step - 1e-9))
        h = (t[k + 1] - t[k]) / steps
        if h != known:
            w, known = _weights(eigenvalues, h), h
        for _ in range(steps):
            _step(table, w, h, y, phi, N)
    return states


@compiled_unlocked
def _march(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    table: FieldTable,
    columns: tuple[IntArray, IntArray],
    max_step: float,
) -> tuple[ComplexArray, ComplexArray]:
    (monomial, runs), m = columns, z0.size
    n, n_column = 2 * m, monomial.size + m
    states, history = np.full((t.size, m), np.nan + 0j), np.full((t.size, n, n_column), np.nan + 0j)
    phi, N = np.empty((4, table.parent.size), dtype=np.complex128), np.empty((4, n, n), dtype=np.complex128)
    A, U = np.empty((n, n), dtype=np.complex128), np.zeros((4, n, n), dtype=np.complex128)
    f, W, new = np.empty((4, 2, monomial.size)), np.zeros((2, n, n_column)), np.empty((2, n, n_column))
    y, known, w = np.concatenate((z0, np.conj(z0))), 0.0, _weights(eigenvalues, 1.0)
    for j in range(m):
        W[0, j, monomial.size + j] = 1.0
    for k in range(t.size):
        states[k], history[k] = y[:m], W[0] + 1j * W[1]
        if k + 1 == t.size or not np.abs(y).max() <= BLOW_UP:
            break
        steps = max(1, math.ceil((t[k + 1] - t[k]) / max_step - 1e-9))
        h = (t[k + 1] - t[k]) / steps
        if h != known:
            w, known = _weights(eigenvalues, h), h
        for _ in range(steps):
            _step(table, w, h, y, phi, N)
            _step_matrices(w, h, N, A, U)
            _sources(phi, monomial, f)
            _advance(A, U, f, runs, W, new)
            W, new = new, W
    return states, history


def motion(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    normal_form: tuple[IntArray, ComplexArray],
    max_step: float,
) -> ComplexArray:
    """Integrate z' = Lambda z + C zeta^E as ``sensitivities`` does, and return z (n_time, m) alone."""
    table = field_table(*normal_form, slopes=False)
    states: ComplexArray = _march_states(t, z0.astype(np.complex128), eigenvalues, table, max_step)
    return states


def sensitivities(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    normal_form: tuple[IntArray, ComplexArray],
    parameters: tuple[IntArray, IntArray],
    max_step: float,
) -> tuple[ComplexArray, ComplexArray]:
    """Integrate z' = Lambda z + C zeta^E and its variational equations.

    Parameters
    ----------
    t : (n_time,) s; z0 : (m,); eigenvalues : (m,) 1/s.
    normal_form : E (n_term, 2m) and C (m, n_term); linear terms are allowed.
    parameters : row and term number of each of the n_parameter coefficients to vary.
    max_step : largest internal step, s.

    Returns
    -------
    z (n_time, m) and W (n_time, 2m, n_parameter + m), d(z, conj z) by the coefficients, then by z(0); both nan after a
    blow-up.
    """
    rows, terms = parameters
    table, plan = field_table(*normal_form, slopes=True), monomial_plan(normal_form[0], slopes=True)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(rows)) + 1, [len(rows)]]).astype(np.int64)
    runs = np.column_stack([rows[edges[:-1]], edges[:-1], edges[1:]]) if len(rows) else np.zeros((0, 3), dtype=np.int64)
    states, W = _march(t, z0.astype(np.complex128), eigenvalues, table, (plan.term[terms], runs), max_step)
    return states, W


def real_slopes(s: ComplexArray, W: ComplexArray) -> ComplexArray:
    """Return g (n_time, n_column), dx = Re(g d theta), of a quantity with dx = Re(sum_i s_i dz_i), s (n_time, m)."""
    both = np.hstack([s, s.conj()])
    g: ComplexArray = (both[:, None, :] @ W)[:, 0]
    return g
