"""The 1:2 resonant von Karman shell: given equations, their normal form, its forced response, and learning it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp

from romgen.arrays import ComplexArray, FloatArray
from romgen.forced_response import forced_response
from romgen.jackknife import jackknife_deviation
from romgen.learn import Learned, Loads, learn, reduced_trajectory
from romgen.manifold import nmte_blocks
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.settings import ForcedResponseSettings, LearnSettings
from romgen.trajectory_error import snapshot_rows
from tests.normal_form_models import linear_charts
from tests.verification.radau import Radau
from tests.verification.shell_normal_form import MASTER, EquationDriven, equation_driven, second_degree
from tests.verification.shell_ringdowns import HELD_OUT, STARTS, STEP, manifold_start, ringdown
from tests.verification.von_karman_shell import DATA, Shell, cubes, products, read_shell

# Published for this model at eps = 0.02: a load of 100 eps cos(Omega t) N across the shell at a quarter of its length.
NODE, FORCE = 60, 2.0
FOLDS, TORI = np.array([147.82, 147.93, 150.55, 150.57]), np.array([149.20, 149.50])
# The last digit printed; the published curve has terms of higher order than three, which shift it by less than that.
PRINTED = 0.01
STATIC_PERCENT, NMTE_PERCENT = 0.941, 7.19


@cache
def shell() -> Shell:
    if not DATA.is_dir():
        pytest.skip(f"{DATA} is absent")
    return read_shell()


@cache
def from_equations() -> EquationDriven:
    return equation_driven(shell())


def modal_load() -> FloatArray:
    """Phi' f per newton."""
    return shell().shapes[np.searchsorted(shell().free, 6 * NODE + 2), :MASTER]


def folds_and_tori(model: ReducedModel, load: str) -> tuple[FloatArray, FloatArray]:
    """Return the folds and torus points of the main branch in rad/s."""
    window = (146.0 / (2.0 * np.pi), 152.5 / (2.0 * np.pi))
    settings = ForcedResponseSettings(input=load, levels=(FORCE,), sensor=model.sensors[0], frequency_range_hz=window)
    curve = forced_response(model, settings).curves[0]
    return 2.0 * np.pi * np.sort(curve.folds_hz), 2.0 * np.pi * np.sort(curve.hopf_hz)


def test_equations_are_those_of_a_structure_with_the_given_modes() -> None:
    """M from W = Phi' M, symmetric K and C = alpha M + beta K, forces with a potential, the printed eigenvalues."""
    s = shell()
    np.testing.assert_allclose(s.eigenvalues[:2], [-0.29845 + 149.2236j, -0.59756 + 298.7806j], atol=6e-5)
    for matrix in (s.M, s.K):
        assert abs(matrix - matrix.T).max() < 1e-11 * abs(matrix).max()
    np.testing.assert_allclose(s.shapes.T @ (s.M @ s.shapes), np.eye(10), atol=1e-12)
    power = np.vstack([np.ones(2), np.abs(s.eigenvalues[:2]) ** 2]).T
    alpha, beta = np.linalg.solve(power, -2.0 * s.eigenvalues[:2].real)
    assert abs(s.C - alpha * s.M - beta * s.K).max() < 1e-6 * abs(s.C).max()
    a, b, c, d = np.random.default_rng(0).standard_normal((4, len(s.free)))
    assert a @ products(s.quadratic, b, c) == pytest.approx(c @ products(s.quadratic, a, b), rel=1e-10)
    assert a @ cubes(s.cubic, b, c, d) == pytest.approx(d @ cubes(s.cubic, a, b, c), rel=1e-10)
    np.testing.assert_allclose(products(s.quadratic, a, a) + cubes(s.cubic, a, a, a), s.force(a), rtol=1e-9, atol=1e3)


def test_manifold_of_second_degree_is_invariant() -> None:
    """The defect of the invariance equation in the other modes falls with the third power of the amplitude."""
    s, w = shell(), second_degree(shell())[1]
    lambdas = s.eigenvalues[:MASTER]
    reduced = from_equations()
    defects = []
    for size in (2e-3, 1e-3):
        p = size * np.array([1.0 + 0.5j, -0.3 + 0.8j])
        zeta = np.concatenate([p, p.conj()])
        mu = np.array([np.array(key) @ np.concatenate([lambdas, lambdas.conj()]) for key in w])
        terms = np.array([value * np.prod(zeta ** np.array(key)) for key, value in w.items()]).T
        q = (s.shapes[:, :MASTER] @ (2.0 * p.real)) + terms.sum(axis=1).real
        v = (s.shapes[:, :MASTER] @ (2.0 * (lambdas * p).real)) + (terms @ mu).real
        a = s.shapes[:, :MASTER] @ (2.0 * (lambdas**2 * p).real) + (terms @ mu**2).real
        defect = s.M @ a + s.C @ v + s.K @ q + s.force(q)
        defects.append(np.linalg.norm(defect - s.M @ (s.shapes[:, :MASTER] @ (s.shapes[:, :MASTER].T @ defect))))
    assert reduced.quadratic.shape == (len(s.free), len(w))
    # next term relative to this one: the amplitude over the thickness, 0.04 here
    assert np.log2(defects[0] / defects[1]) == pytest.approx(3.0, abs=0.1)


def test_forced_response_of_the_cubic_normal_form_has_the_published_bifurcations() -> None:
    reduced, load = from_equations(), modal_load()
    model = linear_charts(
        reduced.eigenvalues,
        PolynomialMap(reduced.exponents, reduced.B),
        load / (2j * reduced.eigenvalues.imag),
        (1, 2),
        trained=np.array([5e-3, 5e-3]),
    )
    folds, tori = folds_and_tori(model, "load")
    np.testing.assert_allclose(folds, FOLDS, atol=PRINTED)
    np.testing.assert_allclose(tori, TORI, atol=PRINTED)


def test_integrator_is_of_fifth_order_and_keeps_frequency_and_damping() -> None:
    """A damped oscillator by halved steps; the error of one radian is below (omega h)^5 / 7200."""
    eigenvalue = -0.3 + 149.2j
    M, C, K = (sp.csr_matrix([[value]]) for value in (1.0, -2.0 * eigenvalue.real, abs(eigenvalue) ** 2))
    errors = []
    for n in (40, 80):
        h = 0.04 / n
        march = Radau((M, C, K), lambda q: 0.0 * q, h)
        q, _, a = march.march(np.array([1.0]), np.array([eigenvalue.real]), n)
        exact: ComplexArray = np.exp(eigenvalue * h * np.arange(n + 1))
        errors.append(abs(q[-1, 0] - exact[-1].real))
        assert errors[-1] < 0.04 * abs(eigenvalue) * (abs(eigenvalue) * h) ** 5 / 7200
        assert a[-1, 0] == pytest.approx((eigenvalue**2 * exact[-1]).real, rel=1e-3)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.2)


def test_ringdown_steps_are_converged() -> None:
    """30 steps of the shell at full amplitude against 60 of half size: the error falls with the fifth power."""
    s = shell()
    q0, v0 = manifold_start(s, np.array(STARTS["both"]))
    ends = [
        Radau((s.M, s.C, s.K), s.force, STEP / n).march(q0, v0, 20 * n)[0][-1] @ (s.M @ s.shapes[:, :MASTER])
        for n in (1, 2)
    ]
    # (omega h)^5 / 7200 of mode 2 over 20 steps is 2e-6 of the amplitude, and more at twice its frequency
    assert np.linalg.norm(ends[0] - ends[1]) < 1e-4 * np.linalg.norm(STARTS["both"])


@cache
def learned() -> Learned:
    """Three ring-downs from starts on the manifold; the held-out one is released from a static load."""
    training = [ringdown(shell(), name) for name in STARTS]
    held_out = [ringdown(shell(), name) for name in HELD_OUT]
    settings = LearnSettings(internal_resonance=(1, 2), order=7, geometry_order=3)
    return learn(training, held_out, settings, "shell", Loads(("force",), ("N",), modal_load()[:, None]))


@pytest.mark.slow
def test_learned_shell_beats_the_published_errors() -> None:
    result = learned()
    name = next(iter(HELD_OUT))
    held_out = ringdown(shell(), name)
    r = reduced_trajectory(held_out, None, LearnSettings())
    rows, snapshots = snapshot_rows(held_out, r)
    assert result.full_field is not None
    static = nmte_blocks(result.full_field, snapshots, r.y[rows])
    assert static < STATIC_PERCENT
    assert result.validation[0].nmte_percent < NMTE_PERCENT
    starts = np.array([[*value] for value in (*STARTS.values(), *HELD_OUT.values())])
    directions = starts / np.linalg.norm(starts, axis=1)[:, None]
    assert np.all(np.abs(directions[:-1] @ directions[-1]) < 0.95)


@pytest.mark.slow
def test_learned_coefficients_are_those_of_the_equations() -> None:
    """Every term of degree 2 and 3 within three jackknife deviations, the quadratic ones within 0.3 %."""
    fit, reduced = learned().fit, from_equations()
    # eta_j = s_j 2 Re(V_jj z_j) against eta_j = 2 Re p_j
    unit = fit.dynamics.scale[:MASTER] * np.diag(fit.dynamics.vectors[:MASTER])
    number = {tuple(row): k for k, row in enumerate(fit.normal_form.exponents.tolist())}
    assert fit.replicates is not None
    deviation = jackknife_deviation(fit.replicates.normal_form)
    np.testing.assert_allclose(fit.dynamics.eigenvalues, reduced.eigenvalues, atol=5e-3)
    for j, k in zip(*np.nonzero(reduced.B), strict=True):
        powers = reduced.exponents[k]
        ratio = np.prod(unit ** powers[:MASTER]) * np.prod(unit.conj() ** powers[MASTER:]) / unit[j]
        column = number[tuple(powers.tolist())]
        error = abs(fit.normal_form.coefficients[j, column] - reduced.B[j, k] * ratio)
        assert error < 3.0 * deviation[j, column]
        if powers.sum() == 2:
            assert error < 3e-3 * abs(reduced.B[j, k] * ratio)


@pytest.mark.slow
def test_learned_shell_answers_the_force_like_the_published_one() -> None:
    folds, tori = folds_and_tori(learned().model, "force")
    np.testing.assert_allclose(folds, FOLDS, atol=PRINTED)
    np.testing.assert_allclose(tori, TORI, atol=PRINTED)
