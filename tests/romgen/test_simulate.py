"""Simulation: order of the scheme, agreement with DOP853, exact linear part, chart inverse."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import InputError, NumericalError
from romgen.etdrk4 import largest_step, phi_functions
from romgen.polynomial import PolynomialMap, evaluate, exponents, zeta
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors, simulate, simulate_reference

EIGENVALUES = np.array([-3.0 + 690.0j, -6.0 + 1240.0j])


@pytest.fixture
def model() -> ReducedModel:
    """Two modes, 1:2 terms, curved chart, two sensors, one input."""
    rng = np.random.default_rng(1)
    e_nf = np.array([[2, 0, 1, 0], [1, 1, 0, 1], [0, 1, 1, 0], [2, 0, 0, 0]])
    nf = np.array([[-9 - 900j, -70 - 280j, -20 + 27j, 0], [0, -19 + 740j, 0, 0.1 + 11j]])
    e_chart = np.vstack([np.eye(4, dtype=np.int64), exponents(4, 2, 3)])
    curve = 0.02 * (rng.normal(size=(4, len(e_chart))) + 1j * rng.normal(size=(4, len(e_chart))))
    curve[:, :4] = 0.0
    curve[[0, 1], [0, 1]] = 1.0
    curve[[2, 3], [0, 1]] = 1j
    inverse = np.zeros((2, 4), dtype=complex)
    inverse[[0, 1], [0, 1]], inverse[[0, 1], [2, 3]] = 1.0, -1j
    e_y = exponents(4, 1, 2)
    return ReducedModel(
        name="two_modes",
        eigenvalues=EIGENVALUES,
        normal_form=PolynomialMap(e_nf, nf),
        chart=PolynomialMap(e_chart, curve),
        inverse_chart=PolynomialMap(np.eye(4, dtype=np.int64), inverse),
        scale=np.array([1e-3, 2e-3, 0.7, 2.0]),
        displacement=PolynomialMap(e_y, 1e-3 * rng.normal(size=(2, len(e_y)))),
        velocity=PolynomialMap(e_y, rng.normal(size=(2, len(e_y)))),
        sensors=("a", "b"),
        inputs=("base_acceleration",),
        input_units=("m/s2",),
        input_matrix=np.array([[0.1 - 0.4j], [0.02 + 0.1j]]),
        internal_resonance=(1, 2),
        trained_amplitude=np.array([0.5, 0.5]),
    )


@pytest.mark.parametrize("c", [0.0j, 1e-9 + 0j, 0.3j, -0.2 + 0.9j, 0.999j, 1.001j, -4.0 + 3.0j])
def test_phi_functions_match_their_series(c: complex) -> None:
    from math import factorial

    for k, phi in enumerate(phi_functions(c), start=1):
        series = sum(c**n / factorial(n + k) for n in range(60))
        # Three divided differences at abs(c) >= 1 lose at most a few roundings of the largest term.
        assert abs(phi - series) < 200 * np.finfo(float).eps * abs(series)


def test_free_linear_decay_is_exact(model: ReducedModel) -> None:
    t = np.linspace(0.0, 1.0, 101)
    z0 = np.array([1e-9, 1e-9j])
    exact = z0 * np.exp(np.outer(t, EIGENVALUES))
    # 1e4 multiplications by e^c round at most eps each; the nonlinear terms are 1e-9 smaller.
    assert np.abs(simulate(model, t, z0) - exact).max() < 1e-9 * (1e4 * np.finfo(float).eps + 1e-7)


def test_step_error_is_of_fourth_order(model: ReducedModel) -> None:
    t = np.linspace(0.0, 0.1, 21)
    u = np.sin(2 * np.pi * 108 * t)[:, None]
    z0 = np.array([0.4 + 0.1j, -0.2j])
    exact = simulate_reference(model, t, z0, u, rtol=1e-12)
    steps = np.array([5e-4, 2.5e-4, 1.25e-4])
    errors = [np.abs(simulate(model, t, z0, u, max_step=h) - exact).max() for h in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(4.0, abs=0.25)


@pytest.mark.parametrize("hold", ["constant", "linear"])
def test_default_step_agrees_with_dop853(model: ReducedModel, hold: str) -> None:
    t = np.linspace(0.0, 0.05, 51)
    u = 4.0 * np.sin(2 * np.pi * 108 * t)[:, None]
    z0 = np.array([0.3 + 0.0j, 0.1j])
    z = simulate(model, t, z0, u, hold=hold)  # type: ignore[arg-type]  # parametrised literal
    reference = simulate_reference(model, t, z0, u, hold=hold, rtol=1e-12)  # type: ignore[arg-type]
    assert np.linalg.norm(z - reference) / np.linalg.norm(reference) < 1e-6


def test_constant_hold_ignores_the_last_sample(model: ReducedModel) -> None:
    t = np.array([0.0, 1e-3])
    z0 = np.zeros(2, dtype=complex)
    held = simulate(model, t, z0, np.array([[1.0], [9.0]]), hold="constant")
    assert np.array_equal(held, simulate(model, t, z0, np.array([[1.0], [-2.0]]), hold="constant"))
    exact = (np.exp(EIGENVALUES * 1e-3) - 1) / EIGENVALUES * model.input_matrix[:, 0]
    # the state stays at 4e-4, where quadratic terms change it by 27 * 4e-4 * 1e-3 relative
    assert held[-1] == pytest.approx(exact, rel=1e-4)


def test_sensors_are_the_composed_maps(model: ReducedModel) -> None:
    z = np.array([[0.3 - 0.2j, 0.1 + 0.25j]])
    w = evaluate(model.chart, zeta(z)).real
    displacement, velocity = sensors(model, z)
    assert displacement == pytest.approx(evaluate(model.displacement, w))
    assert velocity == pytest.approx(evaluate(model.velocity, w))


def test_largest_step() -> None:
    assert largest_step(np.array([-1 + 2j * np.pi * 300])) == 1e-4
    assert largest_step(np.array([-1 + 2j * np.pi * 1000])) == pytest.approx(5e-5)
    # slow structures: a hundred steps per period
    assert largest_step(np.array([-1 + 2j * np.pi * 0.5, -1 + 2j * np.pi])) == pytest.approx(1e-2)


def test_divergence_is_named(model: ReducedModel) -> None:
    with pytest.raises(NumericalError, match="two_modes: the reduced model diverged"):
        simulate(model, np.linspace(0, 1, 100), np.array([50.0 + 0j, 50.0]))


def test_wrong_input_shape_is_named(model: ReducedModel) -> None:
    with pytest.raises(InputError, match="simulate u"):
        simulate(model, np.linspace(0, 1, 5), np.zeros(2, dtype=complex), np.zeros((5, 2)))
