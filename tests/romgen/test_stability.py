"""Free decays from the trained range: a linear model, and one whose damping turns negative at a known amplitude."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.errors import NumericalError
from romgen.etdrk4 import march
from romgen.polynomial import PolynomialMap
from romgen.stability import HORIZON, STARTS, boundary_states, tried_stability
from romgen.trained_range import box_range, trained_range

LAMBDA = np.array([-2.0 + 60.0j, -5.0 + 121.0j])
TRAINED = trained_range(np.array([[0.4, 0.0], [0.2, 0.2], [0.0, 0.3]], dtype=complex))


def cubic(growth: float) -> PolynomialMap[np.complex128]:
    """z_1' = .. + growth abs(z_1)^2 z_1: abs(z_1) falls below sqrt(2 / growth) and grows above."""
    return PolynomialMap(np.array([[2, 0, 1, 0]]), np.array([[growth], [0.0]], dtype=complex))


def test_a_linear_model_decays_at_its_rate() -> None:
    tried = tried_stability(LAMBDA, cubic(0.0), TRAINED)
    assert tried.is_stable
    assert tried.reach == tried.factor[-1]
    np.testing.assert_array_equal(tried.share, 1.0)
    # the first mode alone: rate 2 1/s exactly; ETDRK4 has no error in the linear part
    np.testing.assert_allclose(tried.slowest_rate, 2.0, rtol=1e-12)
    assert tried.linear_rate == 2.0


def test_a_model_is_stable_up_to_the_amplitude_where_its_damping_changes_sign() -> None:
    """abs(z_1) = 0.55 is 1.375 times the trained 0.4: starts at 1 and 1.25 decay, those of mode 1 beyond do not."""
    tried = tried_stability(LAMBDA, cubic(2.0 / 0.55**2), TRAINED)
    assert tried.is_stable
    assert tried.reach == 1.25
    assert tried.share[2] < 1.0
    assert tried.slowest_rate[2] == -np.inf
    # rho' = -2 rho + g rho^3 from 0.4: 1/rho^2 = g/2 + (1/0.16 - g/2) exp(4 t)
    g, t = 2.0 / 0.55**2, HORIZON / 2.0
    rho = (g / 2 + (1 / 0.16 - g / 2) * np.exp(4 * t)) ** -0.5
    alone = np.log(0.4 / rho) / t
    assert tried.slowest_rate[0] == pytest.approx(alone, rel=1e-3)


def test_growth_inside_the_range_is_found() -> None:
    tried = tried_stability(LAMBDA, cubic(2.0 / 0.35**2), TRAINED, (1.0,))
    assert not tried.is_stable
    assert tried.reach == 0.0
    assert 0.0 < tried.share[0] < 1.0


@pytest.mark.parametrize("m", [1, 2, 3])
def test_starts_lie_on_the_boundary(m: int) -> None:
    trained = box_range(np.linspace(0.2, 0.5, m))
    z = boundary_states(trained, STARTS)
    assert z.shape == (STARTS, m)
    np.testing.assert_allclose(trained.distance(z), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(np.count_nonzero(z[:m], axis=1), 1)


def test_rates_are_those_of_fine_steps() -> None:
    """A 1:2 model with strong exchange and a term off resonance, against ETDRK4 at 400 steps per period.

    The fourth-order steps turn a detuned term by at most half a radian, which leaves 2e-5 of it; mean rates of ln 2
    over two time constants then hold to 1e-4.
    """
    exponents = np.array([[0, 1, 1, 0], [2, 0, 0, 0], [2, 0, 1, 0], [0, 2, 0, 1], [3, 0, 0, 0]])
    rows = np.array([[30.0 - 20.0j, 0.0, 8.0j, 0.0, 0.0], [0.0, -30.0 - 20.0j, 0.0, -4.0 + 6.0j, 9.0]])
    normal_form = PolynomialMap(exponents, rows)
    tried = tried_stability(LAMBDA, normal_form, TRAINED, (1.0,))
    t = np.linspace(0.0, HORIZON / 2.0, 3)
    still = np.zeros((2, 2), dtype=complex)
    states = boundary_states(TRAINED, STARTS)
    step = 2.0 * np.pi / (400.0 * LAMBDA.imag.max())
    ends = np.array([march(t, z, LAMBDA, exponents, rows, still, still, step)[-1] for z in states])
    rates = np.log(TRAINED.distance(states) / TRAINED.distance(ends)) / t[-1]
    assert tried.slowest_rate[0] == pytest.approx(rates.min(), rel=1e-4)


def test_a_mode_that_does_not_decay_is_named() -> None:
    with pytest.raises(NumericalError, match=r"1e-09 1/s at 9\.5493 Hz"):
        tried_stability(np.array([-1e-9 + 60.0j, -5.0 + 121.0j]), cubic(0.0), TRAINED)
