"""Loads on the normal form: projection, factor one half, sign of the base acceleration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.forcing import (
    base_acceleration_load,
    chart_input_matrix,
    harmonic_load,
    input_at_states,
    input_matrix,
    linear_part,
)
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from tests.normal_form_models import damped_oscillator, resonant_pair

# One mode of frequency 3 rad/s and damping ratio 0.1, scales of metres and metres per second.
EIGENVALUE = 3.0 * complex(-0.1, np.sqrt(0.99))
SCALE = np.array([0.02, 0.05])


def modal_chart() -> PolynomialMap[np.complex128]:
    """z of eta'' - 2 Re(lambda) eta' + abs(lambda)^2 eta = 0 from (eta, eta') = (z + c.c., lambda z + c.c.)."""
    real = np.array([[1.0, 1.0], [EIGENVALUE, EIGENVALUE.conjugate()]])
    first = (np.linalg.inv(real) @ np.diag(SCALE))[:1]
    return PolynomialMap(np.array([[1, 0], [0, 1], [2, 0]]), np.hstack([first, [[7.0]]]))


def test_linear_part_ignores_higher_orders() -> None:
    assert linear_part(modal_chart()).shape == (1, 2)
    assert not np.any(linear_part(modal_chart()) == 7.0)


def test_projected_load_reproduces_the_modal_equation() -> None:
    """eta = z + c.c. with z' = lambda z + G u must satisfy eta' = lambda z + c.c. and eta'' = ... + phi u."""
    phi = 0.7
    G = input_matrix(modal_chart(), SCALE, np.array([[phi]]))[0, 0]
    assert G + G.conjugate() == pytest.approx(0.0, abs=1e-15)  # u does not enter eta'
    assert (EIGENVALUE * G + (EIGENVALUE * G).conjugate()).real == pytest.approx(phi, rel=1e-14)


def test_static_response_of_the_projected_load() -> None:
    """A constant load gives eta = phi u / omega^2, which fails for a wrong scale or a wrong half of H."""
    G = input_matrix(modal_chart(), SCALE, np.array([[0.7]]))[0, 0]
    assert 2.0 * (-G / EIGENVALUE).real == pytest.approx(0.7 / 9.0, rel=1e-14)


def test_modal_load_of_another_shape_is_refused() -> None:
    with pytest.raises(InputError, match="one row per master mode"):
        input_matrix(modal_chart(), SCALE, np.zeros((2, 1)))


def test_base_acceleration_is_an_inertia_force() -> None:
    """Two masses on springs: the base accelerates upwards, the masses lag, so the modal load is negative."""
    mass = np.diag([2.0, 3.0])
    shapes = np.eye(2) / np.sqrt(np.diag(mass))
    load = base_acceleration_load(shapes, mass @ np.ones(2))
    np.testing.assert_allclose(load[:, 0], [-np.sqrt(2.0), -np.sqrt(3.0)])


def test_cosine_has_half_amplitude() -> None:
    model: ReducedModel = resonant_pair(0.1, 0.01)
    np.testing.assert_allclose(harmonic_load(model, "load", 4.0), [0.0, -0.5j])


def test_unknown_input_names_the_known_ones() -> None:
    with pytest.raises(InputError, match="choose one of load"):
        harmonic_load(resonant_pair(0.1, 0.01), "shaker", 1.0)


def test_input_along_the_chart_is_that_of_the_coordinates() -> None:
    """w = z + conj z + c (z^2 + conj z^2), w' = lambda z + c.c.: (G, conj G) solves the two equations at every z."""
    c = 0.3
    rows = np.array([[2.0, 0.0, 2.0 * c, 0.0], [2.0 * EIGENVALUE, 0.0, 0.0, 0.0]], dtype=np.complex128)
    chart = PolynomialMap(np.array([[1, 0], [0, 1], [2, 0], [0, 2]]), rows)
    one = damped_oscillator(0.02)
    model = replace(one, eigenvalues=np.array([EIGENVALUE]), chart=chart, scale=np.ones(2))
    column = chart_input_matrix(model, np.array([[0.7]]))[:, 0]
    z = np.array([[0.0], [0.2 + 0.1j]])
    G = input_at_states(model, z, column)[:, 0]
    assert G[0] == pytest.approx(column[0], rel=1e-14)
    w_dot = 2.0 * ((1.0 + 2.0 * c * z[:, 0]) * G).real
    w_ddot = 2.0 * (EIGENVALUE * G).real
    np.testing.assert_allclose(w_dot, 0.0, atol=1e-15)
    np.testing.assert_allclose(w_ddot, 0.7, rtol=1e-14)


def test_chart_without_velocity_takes_no_load() -> None:
    model = resonant_pair(0.1, 0.01)
    flat = replace(model.chart, coefficients=np.vstack([model.chart.coefficients[:2]] * 2))
    with pytest.raises(InputError, match="the chart cannot be inverted"):
        chart_input_matrix(replace(model, chart=flat), np.ones((2, 1)))
