"""V24 to V29: normal forms with known answers, and the Duffing decays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import pytest
import scipy.io
from scipy.integrate import solve_ivp

from romgen import conjugacy_residual
from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.conjugacy import fit_conjugacy, homological_start
from romgen.normal_form import NormalFormFit, fit_normal_form
from romgen.polynomial import evaluate, exponents, monomials, zeta
from romgen.reduced_dynamics import decaying_modes
from romgen.regression import ridge_fit

DATA = Path(__file__).parents[2].parent / "shared" / "data"
Scalar = TypeVar("Scalar", np.float64, np.complex128)


def decays(
    force: Callable[[Any], Any], damping: float, starts: tuple[float, ...], duration: float
) -> list[ReducedTrajectory]:
    """Return decays of x'' + 2 damping x' + f(x) = 0 with exact derivatives."""
    out = []
    for k, x0 in enumerate(starts):
        t = np.arange(0.0, duration, 0.05)

        def rate(_: float, s: FloatArray) -> list[float]:
            return [s[1], -force(s[0]) - 2 * damping * s[1]]

        y = solve_ivp(rate, (0, t[-1]), [x0, 0.0], "DOP853", t, rtol=1e-11, atol=1e-13).y.T
        y_dot = np.column_stack([y[:, 1], -force(y[:, 0]) - 2 * damping * y[:, 1]])
        out.append(ReducedTrajectory(str(k), t, y, y_dot, y[:, :1], y[:, 1:]))
    return out


def gamma(fit: NormalFormFit, displacement_per_z: float) -> complex:
    """Return the coefficient of z abs(z)^2 for x = z + conj z."""
    nf = fit.normal_form
    k = nf.exponents.tolist().index([2, 1])
    return complex(nf.coefficients[0, k]) / displacement_per_z**2


def per_z(fit: NormalFormFit) -> float:
    dynamics = fit.dynamics
    return float(abs(dynamics.scale[0] * dynamics.vectors[0, 0]))


def test_v26_damped_cubic() -> None:
    fit = fit_normal_form(decays(lambda x: x + x**3, 0.05, (0.08, 0.05), 80.0), 3, (), 0.0)
    assert fit.dynamics.eigenvalues[0] == pytest.approx(-0.05 + 1j * np.sqrt(1 - 0.0025), rel=1e-6)
    # data-driven limit of the case: 2 percent
    assert gamma(fit, per_z(fit)) == pytest.approx(1.501879j, rel=0.02)


def test_v26_shaw_pierre() -> None:
    """K = [[2, -1], [-1, 2]], C = 0.03 K, force 0.5 x1^3: in-phase mode, x1 = z + conj z, eta = sqrt(2) x1.

    The start lies on the mode, off the manifold by a term of third order in the amplitude 0.2.
    """
    K, shape = np.array([[2.0, -1.0], [-1.0, 2.0]]), np.full(2, np.sqrt(0.5))

    def rate(_: float, s: FloatArray) -> FloatArray:
        return np.concatenate([s[2:], -K @ s[:2] - 0.03 * K @ s[2:] - np.array([0.5 * s[0] ** 3, 0.0])])

    motions = []
    for size in (0.2, 0.15):
        t = np.arange(0.0, 120.0, 0.05)
        x = solve_ivp(rate, (0, t[-1]), [size, size, 0, 0], "DOP853", t, rtol=1e-11, atol=1e-13).y.T
        y = np.column_stack([x[:, :2] @ shape, x[:, 2:] @ shape])
        acceleration = np.array([rate(0.0, s)[2:] for s in x]) @ shape
        motions.append(
            ReducedTrajectory("in phase", t, y, np.column_stack([y[:, 1], acceleration]), x[:, :2], x[:, 2:])
        )
    fit = fit_normal_form(motions, 3, (), 0.0)
    # the terms of degree 5 that order 3 leaves out are 1e-3 of the linear ones
    assert fit.dynamics.eigenvalues[0] == pytest.approx(-0.015 + 0.999887j, abs=1e-4)
    # data-driven limit of the case: 2 percent; no cubic damping
    assert gamma(fit, per_z(fit) / np.sqrt(2)) == pytest.approx(0.375042j, rel=0.02)


def test_v25_quadratic_and_cubic_softening() -> None:
    fit = fit_normal_form(decays(lambda x: x + x**2 + x**3, 0.002, (0.02, 0.015), 300.0), 3, (), 0.0)
    # omega = 1 + Im(gamma) rho^2 with A = 2 rho: slope of omega over A^2 is Im(gamma) / 4
    assert gamma(fit, per_z(fit)).imag / 4 == pytest.approx(-1 / 24, rel=0.02)


def test_v24_backbone_of_the_cubic_improves_with_order() -> None:
    motions = decays(lambda x: x + x**3, 0.002, (0.6, 0.4), 300.0)
    errors = []
    for order in (3, 5):
        fit = fit_normal_form(motions, order, (), 0.0)
        errors.append(abs(_frequency_at_half(fit) - 1.0891582))
    assert errors[1] < errors[0]
    assert errors[1] < 2e-3


def _frequency_at_half(fit: NormalFormFit) -> float:
    """Return omega at the amplitude whose largest displacement is 0.5."""
    chart, nf, dynamics = fit.chart, fit.normal_form, fit.dynamics

    def peak(rho: float) -> float:
        circle: ComplexArray = rho * np.exp(1j * np.linspace(0, 2 * np.pi, 400))[:, None]
        return float(np.abs(evaluate(chart, zeta(circle)).real[:, 0] * dynamics.scale[0]).max())

    rho = np.linspace(0.01, 0.45, 400)
    at = float(np.interp(0.5, [peak(r) for r in rho], rho))
    rate = evaluate(nf, zeta(np.array([[at + 0j]])))[0, 0] / at
    return float(dynamics.eigenvalues[0].imag + rate.imag)


def test_v27_graph_coefficients() -> None:
    """y' = -y + z^2 + abs(z)^2 + c.c.: the graph over z has h11 = 1.111111 per conjugate pair, h20 as printed."""
    rate = -0.05 + 1.0j
    z = 0.5 * np.exp(rate * np.arange(0.0, 60.0, 0.05))
    h20, h11 = 1 / (2 * rate + 1), 1 / (2 * rate.real + 1)
    y: FloatArray = 2 * (h20 * z**2).real + h11 * np.abs(z) ** 2
    phi = np.column_stack([z**2, np.abs(z) ** 2, z.conj() ** 2])
    fitted = ridge_fit(phi, y[:, None].astype(complex), 0.0)[0]
    assert fitted[:2] == pytest.approx([0.187110 - 0.415800j, 1.111111], abs=1e-6)


@pytest.fixture(scope="module")
def duffing() -> tuple[list[FloatArray], float]:
    """States (n_time, 2) of the two decays, and their step in s."""
    path = DATA / "duffing_decays.mat"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    data = scipy.io.loadmat(path)
    return [x.T for x in data["trajectories"]], float(data["times"][0, 1])


Start = tuple[ComplexArray, ComplexArray]


def duffing_fit(
    y: FloatArray, y_dot: FloatArray, orders: tuple[int, int], previous: Start | None = None
) -> tuple[Start, float]:
    """Normal form of the first of ``orders`` with the linear part of a vector field of the second, half its cost."""
    order, linear = orders
    eigenvalues, V = decaying_modes(ridge_fit(monomials(y, exponents(2, 1, linear)), y_dot, 0.0)[:, :2])
    q, q_dot = y @ np.linalg.inv(V).T, y_dot @ np.linalg.inv(V).T
    scale = 2 * np.abs(q).max()
    q, q_dot = q[:, :1] / scale, q_dot[:, :1] / scale
    E = exponents(2, 2, order)
    resonant = (E[:, 0] - E[:, 1] == 1)[None]
    if previous is None:
        g = ridge_fit(monomials(zeta(q), E), q_dot - eigenvalues * q, 0.0)
        start = homological_start(g, eigenvalues, E, resonant)
    else:
        more = ((0, 0), (0, len(E) - previous[0].shape[1]))
        start = np.pad(previous[0], more), np.pad(previous[1], more)
    fit = fit_conjugacy((q, q_dot), eigenvalues, E, resonant, start, 1e-14)
    return (fit.A, fit.B), 0.5 * fit.cost * q.size


@pytest.mark.parametrize(("order", "linear", "known"), [(3, 3, 0.104049), (5, 7, 0.00397203)])
def test_duffing_decays_have_the_known_costs(
    duffing: tuple[list[FloatArray], float], order: int, linear: int, known: float
) -> None:
    """To all six digits: inner differences of order 4, two samples at each end by one-sided ones of order 2.

    Monomials by the chain rule; the linear part of the vector field of order 3, of order 7 for the normal form of order
    5. The recipe of the known costs at orders 7 and 9 was not found: this one comes within 0.4 and 0.9 %.
    """
    motions, step = duffing
    y_dot = np.vstack([_second_order_ends(x, step) for x in motions])
    cost = duffing_fit(np.vstack(motions), y_dot, (order, linear))[1]
    assert cost == pytest.approx(known, rel=6e-6)


def test_duffing_costs_of_high_orders(duffing: tuple[list[FloatArray], float], monkeypatch: pytest.MonkeyPatch) -> None:
    """Half the sum of abs(residual)^2 at the optimum, order by order.

    Another recipe: differences of order 4, one-sided at the ends, for the states *and* the monomials of q, linear part
    fitted at each order. It meets the known costs within -0.19, +0.24, -0.04 % at orders 3, 5, 7. Order 9 has several
    minima: a trust-region solver from the same start ends at +0.08 %, this one lower, at -2.6 %.
    """
    motions, step = duffing
    y, lengths = np.vstack(motions), [len(x) for x in motions]
    y_dot = _rates(y, lengths, step)

    def differences(zz: ComplexArray, zz_dot: ComplexArray, E: IntArray) -> ComplexArray:
        return _rates(monomials(zz, E), lengths, step)

    monkeypatch.setattr(conjugacy_residual, "monomial_rate", differences)
    fit = None
    for order, known, below in (
        (3, 0.104049, 3e-3),
        (5, 0.00397203, 3e-3),
        (7, 0.00053869, 3e-3),
        (9, 2.1877e-4, 0.03),
    ):
        fit, cost = duffing_fit(y, y_dot, (order, order), fit)
        assert -below < cost / known - 1.0 < 3e-3


def _second_order_ends(x: FloatArray, step: float) -> FloatArray:
    """Return x' by differences of order 4, the two samples at each end by three-point one-sided differences."""
    ends = np.vstack([-3.0 * x[:2] + 4.0 * x[1:3] - x[2:4], 3.0 * x[-2:] - 4.0 * x[-3:-1] + x[-4:-2]]) / 2.0
    inner = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12.0
    return np.vstack([ends[:2], inner, ends[2:]]) / step


def _rates(x: npt.NDArray[Scalar], lengths: list[int], step: float) -> npt.NDArray[Scalar]:
    """Return x' of trajectories stacked in x."""
    parts = np.split(x, np.cumsum(lengths)[:-1])
    return np.vstack([_fourth_order(part, step) for part in parts])


def _fourth_order(x: npt.NDArray[Scalar], step: float) -> npt.NDArray[Scalar]:
    """Return x' by differences of order 4, five-point one-sided at both ends."""
    ends = np.array([[-25.0, 48.0, -36.0, 16.0, -3.0], [-3.0, -10.0, 18.0, -6.0, 1.0]]) / 12.0
    inner = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12.0
    return np.vstack([ends @ x[:5], inner, -ends[::-1] @ x[:-6:-1]]) / step
