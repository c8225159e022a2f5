"""The rotating frame: field against the definition, Jacobian against complex step, omissions reported."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.forcing import harmonic_load
from romgen.polynomial import evaluate, zeta
from romgen.rotating_frame import RotatingFrame, resonant_terms, rotating_frame, rotations, split
from tests.normal_form_models import damped_oscillator, published_order7, resonant_pair

OMEGA = 2.0 * np.pi * 108.0
Q = np.array([0.12 - 0.05j, 0.03 + 0.08j])


def frame_of_published_model() -> RotatingFrame:
    model = published_order7(0.4 - 0.3j)
    return rotating_frame(model, harmonic_load(model, "load", 2.0), 0)


def pair_field(frame: RotatingFrame, x: ComplexArray, omega: complex) -> ComplexArray:
    """The field in real arithmetic on pairs (Re, Im), so that both parts may carry an imaginary step of their own."""
    Pair = tuple[complex, complex]

    def times(a: Pair, b: Pair) -> Pair:
        return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]

    m = frame.eigenvalues.size
    q = [(x[j], x[m + j]) for j in range(m)]
    variables = q + [(re, -im) for re, im in q]
    F = np.zeros(2 * m, dtype=np.complex128)
    for j in range(m):
        rate = frame.eigenvalues[j].imag - frame.rotation[j] / frame.forced * omega
        terms = [times((frame.eigenvalues[j].real, rate), q[j]), (frame.load[j].real, frame.load[j].imag)]
        for row, c in zip(frame.terms.exponents, frame.terms.coefficients[j], strict=True):
            product: Pair = (c.real, c.imag)
            for variable, power in zip(variables, row, strict=True):
                for _ in range(power):
                    product = times(product, variable)
            terms.append(product)
        F[j], F[m + j] = sum(t[0] for t in terms), sum(t[1] for t in terms)
    return F


def complex_step(frame: RotatingFrame, x: FloatArray, omega: float) -> tuple[FloatArray, FloatArray]:
    h = 1e-30
    columns = [pair_field(frame, x + 1j * h * e, omega).imag / h for e in np.eye(x.size)]
    return np.array(columns).T, pair_field(frame, x.astype(complex), omega + 1j * h).imag / h


def test_jacobian_against_complex_step() -> None:
    frame = frame_of_published_model()
    _, F_x, F_p = frame.linearise(split(Q), OMEGA)
    by_x, by_omega = complex_step(frame, split(Q), OMEGA)
    # both are exact up to rounding of sums of 20 terms of size abs(lambda)
    np.testing.assert_allclose(F_x, by_x, atol=1e-12 * OMEGA)
    np.testing.assert_allclose(F_p, by_omega, atol=1e-14)


def test_field_is_the_reduced_dynamics_seen_from_the_frame() -> None:
    """q' e^{i r Omega t} + i r Omega z = z' at any time, for the terms and the exp(+i Omega t) part of the load."""
    model = published_order7(0.4 - 0.3j)
    frame = frame_of_published_model()
    t, r = 0.0123, np.array([1, 2])
    turn = np.exp(1j * r * OMEGA * t)
    z = Q * turn
    rate = model.eigenvalues * z + evaluate(model.normal_form, zeta(z[None]))[0]
    rate[0] += (0.4 - 0.3j) * np.exp(1j * OMEGA * t)
    F, _, _ = frame.linearise(split(Q), OMEGA)
    seen = (F[:2] + 1j * F[2:]) * turn + 1j * r * OMEGA * z
    np.testing.assert_allclose(seen, rate, rtol=1e-12)


def test_multipliers_are_those_of_one_period() -> None:
    frame = dataclasses.replace(frame_of_published_model(), load=np.zeros(2, dtype=np.complex128))
    period = 2.0 * np.pi / OMEGA
    expected = np.exp(np.array([-3.5066, -5.8897]) * period)
    moduli = np.sort(np.abs(frame.multipliers(np.zeros(4), OMEGA)))
    np.testing.assert_allclose(moduli, np.sort(np.repeat(expected, 2)), rtol=1e-12)


def test_resonant_terms_of_the_one_to_two_resonance() -> None:
    E = np.array([[0, 1, 1, 0], [2, 0, 0, 0], [2, 0, 1, 0], [3, 0, 0, 1], [1, 1, 0, 0]])
    kept = resonant_terms(E, np.array([1, 2]))
    np.testing.assert_array_equal(kept, [[True, False, True, True, False], [False, True, False, False, False]])


def test_dropped_terms_and_loads_are_reported() -> None:
    oscillator = damped_oscillator(0.1, cubic=0.04)
    frame = rotating_frame(oscillator, harmonic_load(oscillator, "load", 1.0), 0)
    assert frame.terms.exponents.tolist() == [[2, 1]]
    # |z^3| + |conj z^3| + 3 |z conj z^2| at abs(z) = 4, coefficient 0.04 / (2 omega_d), over abs(lambda) = 1
    assert frame.dropped_terms[0] == pytest.approx(5 * 0.02 / np.sqrt(1 - 0.0025) * 4.0**2, rel=1e-12)
    pair = resonant_pair(0.1, 0.01)
    first = rotating_frame(pair, np.array([0.3, 0.2j]), 0)
    np.testing.assert_array_equal(first.load, [0.3, 0.0])
    np.testing.assert_array_equal(first.dropped_load, [0.0, 0.2j])


def test_orbit_of_a_linear_model_is_exact() -> None:
    """Without nonlinear terms the first-order correction is the whole answer of every mode."""
    pair = resonant_pair(0.0, 0.01)
    load = np.array([0.3, 0.2j])
    frame = rotating_frame(pair, load, 0)
    omega = 1.05
    z = frame.orbits(split(frame.linear_response(omega))[None], np.array([omega]), 16)[0]
    t = 2.0 * np.pi / omega * np.arange(16) / 16
    expected = [
        load / (1j * omega - pair.eigenvalues) * np.exp(1j * omega * time)
        + load / (-1j * omega - pair.eigenvalues) * np.exp(-1j * omega * time)
        for time in t
    ]
    np.testing.assert_allclose(z, expected, atol=1e-12)


def test_rotations_need_one_integer_per_mode() -> None:
    model = resonant_pair(0.1, 0.01)
    assert rotations(dataclasses.replace(model, internal_resonance=())).tolist() == [1, 1]
    with pytest.raises(InputError, match="one positive integer per master mode"):
        rotations(dataclasses.replace(model, internal_resonance=(1,)))
