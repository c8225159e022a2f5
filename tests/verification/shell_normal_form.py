"""The cubic normal form of the shell computed from its equations: parametrisation of the manifold by degrees.

State x = (q, q') on the manifold of the modes Phi = (phi_1, phi_2), with modal amplitudes p_j (q ~ 2 Re phi_j p_j),
graph style: the master parts of x are linear in zeta = (p, conj p), the others w(zeta) = sum_k w_k zeta^k. By degrees

    degree 2   f_k = T2(Phi ., Phi .),   (mu^2 M + mu C + K) w_k = -(1 - M Phi Phi') f_k,   mu = <k, (lambda, conj)>
    degree 3   f_k = 2 T2(Phi ., w .) + T3(Phi ., Phi ., Phi .)
    p_j' = lambda_j p_j - phi_j' f / (lambda_j - conj lambda_j)                             up to degree 3

(Haller and Ponsioen 2016, Jain and Haller 2022, Li, Jain and Haller 2022). The change z = p + A zeta^k without resonant
terms then leaves z' = lambda z + B zeta^k with resonant terms only: degree 2 is exact division by lambda_j - mu, degree
3 collects what degree 2 leaves, S = R3 + (D A2) R2 - (D B2) A2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.sparse.linalg import splu

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.polynomial import exponents, zeta
from romgen.resonance import integer_resonance
from tests.verification.von_karman_shell import Shell, cubes, products

MASTER = 2
Polynomial = dict[tuple[int, ...], ComplexArray]
"""Exponents over (p, conj p) -> coefficients of all rows."""


@dataclass(frozen=True)
class EquationDriven:
    """Normal form over the monomials of degree 2 and 3.

    Attributes
    ----------
    eigenvalues : (2,) 1/s; exponents : (n_term, 4) over (z, conj z).
    A, B : (2, n_term) change of coordinates and dynamics in units of p: eta_j = p_j + conj p_j.
    quadratic : (n_dof, 10) w_k, the manifold at degree 2, over the first ten exponents.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    A: ComplexArray = field(metadata={"unit": "m kg^0.5 per term", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s per term", "axes": "mode,term"})
    quadratic: ComplexArray = field(metadata={"unit": "m per term", "axes": "dof,term"})


def equation_driven(shell: Shell) -> EquationDriven:
    """Return the cubic normal form of the first two modes, resonance 1:2."""
    eigenvalues = shell.eigenvalues[:MASTER]
    f2, w = second_degree(shell)
    f3 = third_degree(shell, w)
    R2, R3 = modal_rates(shell, f2), modal_rates(shell, f3)
    E = exponents(2 * MASTER, 2, 3)
    resonant = integer_resonance(eigenvalues, E, (1, 2)).resonant
    number = {tuple(row): k for k, row in enumerate(E.tolist())}
    A, B = np.zeros((2, MASTER, len(E)), dtype=np.complex128)

    def remove(rates: Polynomial) -> None:
        for key, value in rates.items():
            k = number[key]
            gap = eigenvalues - np.array(key) @ zeta(eigenvalues)
            B[:, k] = np.where(resonant[:, k], value, 0.0)
            A[:, k] = np.where(resonant[:, k], 0.0, value / np.where(resonant[:, k], 1.0, gap))

    remove(R2)
    A2: Polynomial = {key: A[:, number[key]] for key in R2}
    B2: Polynomial = {key: B[:, number[key]] for key in R2}
    remove(added(R3, derivative_along(A2, R2), derivative_along(B2, A2), signs=(1.0, 1.0, -1.0)))
    return EquationDriven(eigenvalues, E, A, B, np.array([w[tuple(row)] for row in E[: len(w)].tolist()]).T)


def second_degree(shell: Shell) -> tuple[Polynomial, Polynomial]:
    """Return f_k and w_k of degree 2."""
    linear = linear_part(shell)
    f: Polynomial = {}
    for a, b in product(linear, repeat=2):
        accumulate(f, plus(a, b), products(shell.quadratic, linear[a], linear[b]))
    shapes = shell.shapes[:, :MASTER]
    lambdas, w = zeta(shell.eigenvalues[:MASTER]), {}
    for key, value in f.items():
        mu = np.array(key) @ lambdas
        rest = value - shell.M @ (shapes @ (shapes.T @ value))
        w[key] = -splu((mu**2 * shell.M + mu * shell.C + shell.K).tocsc()).solve(rest)
    return f, w


def third_degree(shell: Shell, w: Polynomial) -> Polynomial:
    """Return f_k of degree 3."""
    linear = linear_part(shell)
    f: Polynomial = {}
    for a, b in product(linear, w):
        accumulate(f, plus(a, b), 2.0 * products(shell.quadratic, linear[a], w[b]))
    for a, b, c in product(linear, repeat=3):
        accumulate(f, plus(plus(a, b), c), cubes(shell.cubic, linear[a], linear[b], linear[c]))
    return f


def modal_rates(shell: Shell, f: Polynomial) -> Polynomial:
    """Return p_j' = -phi_j' f / (lambda_j - conj lambda_j)."""
    share = -1.0 / (2j * shell.eigenvalues[:MASTER].imag)
    return {key: share * (shell.shapes[:, :MASTER].T @ value) for key, value in f.items()}


def linear_part(shell: Shell) -> Polynomial:
    """Return q = sum_j phi_j (p_j + conj p_j)."""
    unit = np.eye(2 * MASTER, dtype=np.int64)
    return {tuple(unit[i].tolist()): shell.shapes[:, i % MASTER].astype(np.complex128) for i in range(2 * MASTER)}


def derivative_along(p: Polynomial, rate: Polynomial) -> Polynomial:
    """Return sum_i (dp / d zeta_i) zeta_i' for zeta' = (rate, conj rate)."""
    full: Polynomial = {}
    for key, value in rate.items():
        accumulate(full, key, np.concatenate([value, np.zeros(MASTER)]))
        accumulate(full, swapped(key), np.concatenate([np.zeros(MASTER), value.conj()]))
    total: Polynomial = {}
    for (key, value), (other, direction) in product(p.items(), full.items()):
        for i, power in enumerate(key):
            if power:
                lowered = tuple(k - (i == j) for j, k in enumerate(key))
                accumulate(total, plus(lowered, other), power * value * direction[i])
    return total


def added(*parts: Polynomial, signs: tuple[float, ...]) -> Polynomial:
    """Return the signed sum."""
    total: Polynomial = {}
    for part, sign in zip(parts, signs, strict=True):
        for key, value in part.items():
            accumulate(total, key, sign * value)
    return total


def accumulate(p: Polynomial, key: tuple[int, ...], value: ComplexArray | FloatArray) -> None:
    """Add a term in place."""
    p[key] = p[key] + value if key in p else value.astype(np.complex128)


def plus(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    """Return the exponents of a product."""
    return tuple(i + j for i, j in zip(a, b, strict=True))


def swapped(key: tuple[int, ...]) -> tuple[int, ...]:
    """Return the exponents of the conjugate monomial."""
    return key[MASTER:] + key[:MASTER]
