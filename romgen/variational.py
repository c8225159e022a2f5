"""Trajectories of a normal form together with their sensitivities to coefficients and initial state.

The variational equations of z' = Lambda z + C zeta^E have the same linear part in every column,

    S' = Lambda S + N_z S + N_conj(z) conj(S) + dN/dtheta,

so ETDRK4 (see ``etdrk4``) advances (z, S) with the weights of z. A complex coefficient theta_p of row r and term k
has two real columns, d/dRe with source e_r zeta^E_k and d/dIm with i times it; the last 2m columns are d/dRe z_j(0)
and d/dIm z_j(0).
"""

from __future__ import annotations

import math

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.compiled import compiled, compiled_unlocked
from romgen.etdrk4 import step_weights


@compiled
def _field(
    Y: ComplexArray, E: IntArray, C: ComplexArray, rows: IntArray, terms: IntArray, powers: ComplexArray
) -> ComplexArray:
    """Return the nonlinear part of (z, S)', (m, 1 + n_column), for Y = (z, S)."""
    m, n_column = Y.shape[0], Y.shape[1] - 1
    n_term = E.shape[0]
    for i in range(m):
        powers[i, 0], powers[m + i, 0] = 1.0, 1.0
        for degree in range(1, powers.shape[1]):
            powers[i, degree] = powers[i, degree - 1] * Y[i, 0]
            powers[m + i, degree] = np.conj(powers[i, degree])
    F = np.zeros_like(Y)
    phi = np.empty(n_term, dtype=np.complex128)
    J = np.zeros((m, 2 * m), dtype=np.complex128)
    for k in range(n_term):
        product = 1.0 + 0.0j
        for i in range(2 * m):
            product *= powers[i, E[k, i]]
        phi[k] = product
        for j in range(m):
            F[j, 0] += C[j, k] * product
        for i in range(2 * m):
            if E[k, i] > 0:
                slope = E[k, i] * powers[i, E[k, i] - 1]
                for other in range(2 * m):
                    if other != i:
                        slope *= powers[other, E[k, other]]
                for j in range(m):
                    J[j, i] += C[j, k] * slope
    for c in range(1, n_column + 1):
        for j in range(m):
            total = 0.0 + 0.0j
            for i in range(m):
                total += J[j, i] * Y[i, c] + J[j, m + i] * np.conj(Y[i, c])
            F[j, c] = total
    for p in range(rows.size):
        F[rows[p], 1 + 2 * p] += phi[terms[p]]
        F[rows[p], 2 + 2 * p] += 1j * phi[terms[p]]
    return F


@compiled
def _combine(
    u: FloatArray | ComplexArray, Y: ComplexArray, v: FloatArray | ComplexArray, F: ComplexArray
) -> ComplexArray:
    out = np.empty_like(Y)
    for j in range(Y.shape[0]):
        for c in range(Y.shape[1]):
            out[j, c] = u[j] * Y[j, c] + v[j] * F[j, c]
    return out


@compiled_unlocked
def _march(
    t: FloatArray,
    z0: ComplexArray,
    eigenvalues: ComplexArray,
    E: IntArray,
    C: ComplexArray,
    rows: IntArray,
    terms: IntArray,
    max_step: float,
) -> ComplexArray:
    m, n_column = z0.size, 2 * rows.size + 2 * z0.size
    powers = np.empty((2 * m, E.max() + 1), dtype=np.complex128)
    history = np.empty((t.size, m, 1 + n_column), dtype=np.complex128)
    Y = np.zeros((m, 1 + n_column), dtype=np.complex128)
    for j in range(m):
        Y[j, 0] = z0[j]
        Y[j, 1 + 2 * rows.size + j] = 1.0
        Y[j, 1 + 2 * rows.size + m + j] = 1j
    history[0] = Y
    known = 0.0
    weights = step_weights(eigenvalues, 1.0)
    for k in range(t.size - 1):
        n = max(1, math.ceil((t[k + 1] - t[k]) / max_step - 1e-9))
        h = (t[k + 1] - t[k]) / n
        if h != known:
            weights, known = step_weights(eigenvalues, h), h
        for _ in range(n):
            F = _field(Y, E, C, rows, terms, powers)
            a = _combine(weights[1], Y, weights[2], F)
            F_a = _field(a, E, C, rows, terms, powers)
            b = _combine(weights[1], Y, weights[2], F_a)
            F_b = _field(b, E, C, rows, terms, powers)
            d = _combine(weights[1], a, weights[2], 2.0 * F_b - F)
            F_d = _field(d, E, C, rows, terms, powers)
            Y = _combine(weights[0], Y, weights[3], F)
            for j in range(m):
                for c in range(1 + n_column):
                    Y[j, c] += weights[4, j] * (F_a[j, c] + F_b[j, c]) + weights[5, j] * F_d[j, c]
        history[k + 1] = Y
        if not np.isfinite(abs(Y[0, 0])) or np.abs(Y[:, 0]).max() > 1e3:
            history[k + 1 :] = np.nan
            break
    return history


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
    z (n_time, m) and S (n_time, m, 2 n_parameter + 2m); nan after a blow-up.
    """
    E, C = normal_form
    history = _march(t, z0, eigenvalues, E, np.ascontiguousarray(C), *parameters, max_step)
    return history[:, :, 0], history[:, :, 1:]
