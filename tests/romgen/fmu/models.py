"""A small random, stable reduced model for the tests of the exported units."""

from __future__ import annotations

import math

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.polynomial import PolynomialMap, exponents
from romgen.reduced_model import ReducedModel

SENSORS = ("lower", "mid span", "upper")


def random_model(
    order: int = 5, n_input: int = 1, seed: int = 7, name: str = "random_panel", sensor_order: int | None = None
) -> ReducedModel:
    """Two modes near 110 and 221 Hz with 0.4 % damping, conservative terms of the 1:2 resonance, three sensors.

    Coefficients of degree d fall as 1/d!; amplitudes of order 1 are trained. Sensor maps are of the same order unless
    told otherwise.
    """
    rng = np.random.default_rng(seed)
    omega = 2.0 * np.pi * np.array([110.0, 221.0])
    lam: ComplexArray = omega * (-0.004 + 1j * np.sqrt(1.0 - 0.004**2))
    real = exponents(4, 1, order)
    chart = 0.05 * _decay(real) * _complex(rng, (4, len(real)))
    for j in range(2):
        chart[j, j] += 1.0
        chart[2 + j, j] += 1j
    field = exponents(4, 1, sensor_order or order)
    x = 1e-3 * _decay(field) * rng.standard_normal((3, len(field)))
    v = 1e-3 * omega[0] * _decay(field) * rng.standard_normal((3, len(field)))
    return ReducedModel(
        name=name,
        eigenvalues=lam,
        normal_form=_conservative_terms(rng, order),
        chart=PolynomialMap(real, chart),
        inverse_chart=PolynomialMap(real, _complex(rng, (2, len(real)))),
        scale=np.ones(4),
        displacement=PolynomialMap(field, x),
        velocity=PolynomialMap(field, v),
        sensors=SENSORS,
        inputs=("base_acceleration", "shaker force")[:n_input],
        input_units=("m/s2", "N")[:n_input],
        input_matrix=0.4 * _complex(rng, (2, n_input)),
        internal_resonance=(1, 2),
        trained_amplitude=np.array([1.0, 0.8]),
        trained_facets=np.array([[1.0, 0.0], [0.7, 0.8], [0.0, 1.25]]),
    )


def random_states(model: ReducedModel, n: int, seed: int = 1) -> ComplexArray:
    """(n, m) states inside the trained range."""
    rng = np.random.default_rng(seed)
    radius = model.trained_amplitude * rng.uniform(0.0, 1.0, (n, len(model.eigenvalues)))
    phase = np.exp(2j * np.pi * rng.uniform(0.0, 1.0, radius.shape))
    z: ComplexArray = radius * phase
    return z


def smooth_input(n_time: int, step: float, n_input: int = 1, seed: int = 3) -> FloatArray:
    """(n_time, n_input) random sums of sines below 300 Hz, about 30 in their unit."""
    rng = np.random.default_rng(seed)
    t = step * np.arange(n_time)[:, None]
    u = np.zeros((n_time, n_input))
    for f in np.linspace(20.0, 300.0, 15):
        u += rng.standard_normal(n_input) * 8.0 * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.28, n_input))
    return u


def _conservative_terms(rng: np.random.Generator, order: int) -> PolynomialMap[np.complex128]:
    """N_j = i dH / d conj z_j for a random real H(z, conj z) invariant under (z_1, z_2) -> (e^ia z_1, e^2ia z_2).

    Then |z_1|^2 + 2 |z_2|^2 is constant under N, so every motion with linear damping stays bounded.
    """
    table = exponents(4, 3, order + 1)
    invariant = [tuple(e) for e in table[table @ np.array([1, 2, -1, -2]) == 0]]
    h = {e: complex(*rng.standard_normal(2)) * 60.0 / math.factorial(sum(e) - 1) for e in invariant}
    h = {e: h[e] + h[e[2:] + e[:2]].conjugate() for e in invariant}
    terms: dict[tuple[int, ...], list[complex]] = {}
    for e, c in h.items():
        for j in range(2):
            lowered = tuple(n - (i == 2 + j) for i, n in enumerate(e))
            if e[2 + j]:
                terms.setdefault(lowered, [0j, 0j])[j] += 1j * c * e[2 + j]
    rows = sorted(terms, key=lambda e: (sum(e), e))
    return PolynomialMap(np.array(rows, dtype=np.int64), np.array([terms[e] for e in rows]).T)


def _decay(e: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> FloatArray:
    degree = np.sum(e, axis=1)
    factorial = np.cumprod(np.arange(1.0, np.max(degree) + 1.0))
    decay: FloatArray = 1.0 / factorial[degree - 1]
    return decay


def _complex(rng: np.random.Generator, shape: tuple[int, int]) -> ComplexArray:
    c: ComplexArray = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return c


def duffing_chain(m: int) -> ReducedModel:
    """m uncoupled damped oscillators with cubic frequency shift, linear chart, one sensor each."""
    lam: ComplexArray = 2.0 * np.pi * np.arange(1, m + 1) * 70.0 * (-0.01 + 1j)
    unit = np.eye(2 * m, dtype=np.int64)
    cubic = 2 * unit[:m] + unit[m:]
    chart = np.vstack([np.hstack([np.eye(m), np.zeros((m, m))]), np.hstack([1j * np.eye(m), np.zeros((m, m))])])
    return ReducedModel(
        name=f"chain_{m}",
        eigenvalues=lam,
        normal_form=PolynomialMap(cubic, 25j * np.eye(m)),
        chart=PolynomialMap(unit, chart.astype(np.complex128)),
        inverse_chart=PolynomialMap(unit, np.hstack([np.eye(m), -1j * np.eye(m)])),
        scale=np.ones(2 * m),
        displacement=PolynomialMap(unit, np.hstack([np.eye(m), np.zeros((m, m))])),
        velocity=PolynomialMap(unit, np.hstack([np.zeros((m, m)), np.diag(lam.imag)])),
        sensors=tuple(f"mass_{j}" for j in range(1, m + 1)),
        inputs=("force",),
        input_units=("N",),
        input_matrix=np.ones((m, 1), dtype=np.complex128),
        internal_resonance=(),
        trained_amplitude=np.ones(m),
    )
