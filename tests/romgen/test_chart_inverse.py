"""Inverse of the chart: the state of a point on it, the nearest where it does not reach, and a word about that."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from romgen.chart_inverse import chart_inverse, initial_state, linear_start
from romgen.polynomial import PolynomialMap, evaluate, zeta
from romgen.reduced_model import ReducedModel

BENT = 0.5
LARGEST = 2.0 / (3.0 * np.sqrt(3.0 * BENT))


@pytest.fixture
def model() -> ReducedModel:
    """w = (x - BENT x^3, -Im z) with x = Re z: w_1 is at most LARGEST, at x = 1 / sqrt(3 BENT)."""
    exponents = np.array([[1, 0], [0, 1], [3, 0], [2, 1], [1, 2], [0, 3]])
    cubic = -BENT / 8.0 * np.array([1.0, 3.0, 3.0, 1.0])
    chart = np.array([[1.0, 0.0, *cubic], [1.0j, 0.0, 0.0, 0.0, 0.0, 0.0]], dtype=np.complex128)
    straight = PolynomialMap(np.eye(2, dtype=np.int64), np.array([[1.0, -1.0j]]))
    none = np.zeros((1, 2))
    return ReducedModel(
        name="bent",
        eigenvalues=np.array([-1.0 + 60.0j]),
        normal_form=PolynomialMap(np.array([[2, 1]]), np.array([[0.0j]])),
        chart=PolynomialMap(exponents, chart),
        inverse_chart=straight,
        scale=np.array([2.0, 0.5]),
        displacement=PolynomialMap(np.eye(2, dtype=np.int64), none),
        velocity=PolynomialMap(np.eye(2, dtype=np.int64), none),
        sensors=("tip",),
        inputs=(),
        input_units=(),
        input_matrix=np.zeros((1, 0), dtype=np.complex128),
        internal_resonance=(),
        trained_amplitude=np.array([0.5]),
    )


def test_point_of_the_chart_is_inverted(model: ReducedModel) -> None:
    z0 = np.array([0.5 - 0.2j])
    y0 = evaluate(model.chart, zeta(z0[None]))[0].real * model.scale
    assert initial_state(model, y0) == pytest.approx(z0, abs=1e-12)
    w = np.array([0.5 - BENT * 0.5**3, 0.2])
    assert linear_start(model, y0) == pytest.approx(np.array([w[0] - 1j * w[1]]))


def test_point_beyond_the_chart_gives_the_nearest(model: ReducedModel, caplog: pytest.LogCaptureFixture) -> None:
    """Flat there: the misfit is quadratic in what is left of x, so its relative end of 1e-6 leaves 1e-3 of x."""
    w0 = np.array([1.2 * LARGEST, 0.3])
    z, misfit = chart_inverse(model, w0 * model.scale)
    assert z[0].real == pytest.approx(1.0 / np.sqrt(3.0 * BENT), rel=1e-2)
    assert z[0].imag == pytest.approx(-0.3, abs=1e-6)
    assert misfit == pytest.approx(0.2 * LARGEST, rel=1e-4)
    with caplog.at_level(logging.WARNING):
        initial_state(model, w0 * model.scale)
    assert "misses y by 0.11 of its size" in caplog.text
