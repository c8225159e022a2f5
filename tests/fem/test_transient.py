"""Marching: against a dense Newton reference, base excitation, batches, failures."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fem.errors import FemConvergenceError
from fem.model import Support
from fem.modes import Rayleigh, solve_modes
from fem.motion import MotionState, StepRecord
from fem.preload import StaticSettings, solve_static
from fem.step_equation import StepProblem, Trial
from fem.transient import Transient, TransientSettings
from fem.viscous_tangent import viscous_stiffness
from tests.fem.conftest import Strip
from tests.fem.small_models import box, distorted, single, wave

STEP = 5e-5


def make_transient(strip: Strip, **options: object) -> Transient:
    """A transient of the strip for motions of about 1 mm in its first mode."""
    scale = float(np.linalg.norm(strip.modes.left[:, 0] * strip.modes.omega[0] ** 2 * strip.eta))
    settings = replace(TransientSettings(STEP, tolerance=1e-7, corrected_modes=1, solver="superlu"), **options)
    return Transient(strip.model, strip.equilibrium, strip.modes, strip.damping, settings, force_scale=scale)


def released(strip: Strip, transient: Transient) -> MotionState:
    """The held strip let go at rest."""
    displacement = (strip.held.u - strip.equilibrium.u)[:, None]
    return transient.start(displacement, np.zeros_like(displacement), strip.held.contact.slip, settled=True)


def _newton_step(strip: Strip, transient: Transient, old: MotionState) -> np.ndarray:
    """u of the next step by full Newton with consistent tangents on the equations of Chung & Hulbert."""
    model, s, h = strip.model, transient.scheme, transient.settings.time_step
    beta = strip.damping.beta
    C = strip.damping.alpha * model.mass + beta * model.stiffness
    left = strip.modes.left[:, :1]
    r = transient.scheme.frequency_corrected_inertia(float(strip.modes.omega[0]), h)
    M = model.mass.toarray() + r * left @ left.T
    u0, v0, a0 = old.u[:, 0], old.v[:, 0], old.a[:, 0]

    def force(u: np.ndarray, history: np.ndarray) -> np.ndarray:
        traction = model.contact.evaluate(model.contact.relative(u[:, None]), history).traction
        return (model.elastic_force(u[:, None])[0] + model.contact.force(traction))[:, 0]

    def viscous(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.asarray(model.body_forces(u[:, None], v[:, None], beta)[1][:, 0])

    f_old, slip, free = old.force[:, 0] + viscous(u0, v0), old.slip, model.free
    a = a0.copy()
    for _ in range(30):
        u = u0 + h * v0 + h * h * ((0.5 - s.beta) * a0 + s.beta * a)
        v = v0 + h * ((1.0 - s.gamma) * a0 + s.gamma * a)
        residual = (
            M @ ((1.0 - s.alpha_m) * a + s.alpha_m * a0)
            + C @ ((1.0 - s.alpha_f) * v + s.alpha_f * v0)
            + (1.0 - s.alpha_f) * (force(u, slip) + viscous(u, v))
            + s.alpha_f * f_old
            - model.load
        )[free]
        K = model.elastic_tangent(u) + model.contact.tangent(u, slip[:, :, 0])
        # Without the slope of the viscous force in u, which is of the order of beta times the strain rate.
        D = C + beta * (model.elastic_tangent(u, geometric=False) - model.stiffness)
        J = (1.0 - s.alpha_m) * M + (1.0 - s.alpha_f) * (h * s.gamma * D + h * h * s.beta * K).toarray()
        change = np.linalg.solve(J[np.ix_(free, free)], residual)
        a[free] -= change
        if np.linalg.norm(change) < 1e-11 * np.linalg.norm(a):
            return np.asarray(u0 + h * v0 + h * h * ((0.5 - s.beta) * a0 + s.beta * a))
    raise AssertionError("the reference Newton does not converge")


def test_steps_equal_a_full_newton_reference(strip: Strip) -> None:
    """The frozen corotated factor with Anderson solves the same equations, sticking and slipping.

    A residual of 1e-7 of the peak inertia force M omega^2 u moves u by about 1e-7 (omega h)^2 u in mode 1; 1e-7 u
    leaves room for the modes above.
    """
    transient = make_transient(strip)
    state = released(strip, transient)
    moved, slipping = np.abs(strip.held.u - strip.equilibrium.u).max(), 0
    for record in transient.march(state, 25):
        if record.state.step % 3 == 0:
            expected = _newton_step(strip, transient, state)
            np.testing.assert_allclose(record.state.u[:, 0], expected, atol=1e-7 * moved)
        slipping += int((record.contact.status == 2).sum())
        state = record.state
    assert slipping > 0, "the case should slip"


def test_fast_path_and_full_newton_give_the_same_trajectory(strip: Strip) -> None:
    """60 steps, slipping: the paths part by the tolerance of every step, at worst with the square of their number."""
    fast = make_transient(strip)
    newton = make_transient(strip, method="newton")
    motion, iterations = [], []
    for transient in (fast, newton):
        records = list(transient.march(released(strip, transient), 60))
        motion.append(np.array([r.state.u[:, 0] for r in records]))
        iterations.append(np.mean([r.iterations[0] for r in records]))
        assert sum((r.contact.status == 2).sum() for r in records) > 0, "the case should slip"
    moved = np.abs(strip.held.u - strip.equilibrium.u).max()
    np.testing.assert_allclose(motion[0], motion[1], atol=0.5 * 60**2 * 1e-7 * moved)
    assert iterations[1] < 0.5 * iterations[0]


def test_newton_contracts_quadratically(strip: Strip) -> None:
    """Once it slips no more differently: r_(k+1) < 10 r_k^2 between 1e-1 and roundoff, 1e-9."""
    transient = make_transient(strip, method="newton", tolerance=1e-9, max_iterations=8)
    seen: list[float] = []
    size = transient._corrector.size

    def watched(trial: Trial, problem: StepProblem) -> np.ndarray:
        found = size(trial, problem)
        seen.append(float(found[0]))
        return found

    transient._corrector.size = watched  # type: ignore[method-assign]
    list(transient.march(released(strip, transient), 3))
    pairs = [(a, b) for a, b in pairwise(seen) if b < a < 0.1]
    assert len(pairs) >= 3
    assert all(b < 10.0 * a**2 + 1e-9 for a, b in pairs)


def test_viscous_tangent_is_the_derivative_of_the_viscous_force() -> None:
    """Central differences of a polynomial of third order in u: exact but for roundoff."""
    model = single(distorted(box((1.0, 1.0, 1.0), (1, 1, 1)), 0.05))
    u, v = wave(model.points, 0.1), wave(model.points[:, ::-1], 3.0)
    tangent = viscous_stiffness(model, u, v, 0.01)
    direction, step = np.random.default_rng(0).normal(size=model.n_dof), 1e-4

    def viscous(x: np.ndarray) -> np.ndarray:
        return np.asarray(model.body_forces(x[:, None], v[:, None], 0.01)[1][:, 0])

    slope = (viscous(u + step * direction) - viscous(u - step * direction)) / (2.0 * step)
    np.testing.assert_allclose(tangent @ direction, slope, atol=1e-6 * np.abs(slope).max())


def test_equilibrium_stays_at_rest(strip: Strip) -> None:
    transient = make_transient(strip)
    zero = np.zeros((strip.model.n_dof, 1))
    *_, last = transient.march(transient.start(zero, zero), 20)
    # The residual of the equilibrium, 1e-8 of 4 kN, is below the tolerance: nothing is corrected.
    assert np.abs(last.state.u[:, 0] - strip.equilibrium.u).max() < 1e-9
    assert not last.iterations.any()


def test_batch_of_cases_equals_single_runs(strip: Strip) -> None:
    transient = make_transient(strip)
    one = released(strip, transient).u - strip.equilibrium.u[:, None]
    both = np.hstack([one, 0.2 * one])
    *_, together = transient.march(transient.start(both, 0.0 * both), 10)
    for case in range(2):
        start = np.ascontiguousarray(both[:, case : case + 1])
        *_, alone = transient.march(transient.start(start, 0.0 * start), 10)
        # Same iterations on the same numbers: differences are roundoff, amplified up to the iteration tolerance.
        np.testing.assert_allclose(together.state.u[:, case], alone.state.u[:, 0], atol=1e-6 * np.abs(one).max())


def test_initial_acceleration_balances(strip: Strip) -> None:
    transient = make_transient(strip)
    state = released(strip, transient)
    record = transient.observe(state)
    model = strip.model
    inertia = (model.mass @ state.a)[model.free]
    np.testing.assert_allclose(inertia, record.net_force[model.free], atol=1e-9 * np.abs(record.net_force).max())
    assert record.energies[0, 0] == 0.0
    assert not state.work.any()
    # Only the held mode accelerates: the rest of a snap-back start is in balance, to the tolerance of the hold.
    across = strip.modes.shapes[:, 1:].T @ record.net_force
    assert np.abs(across).max() < 1e-4 * np.abs(strip.modes.shapes[:, :1].T @ record.net_force).max()


def test_static_base_acceleration_is_gravity() -> None:
    """Under constant acceleration of the base a damped cantilever settles at K u = -M b a."""
    mesh = box((0.2, 0.01, 0.01), (3, 1, 1))
    model = single(mesh, supports=(Support("body.x_min", ("x", "y", "z")),))
    rest = solve_static(model, model.load, StaticSettings(steps=1, solver="superlu"))
    modes = solve_modes(model, rest, 2, solver="superlu")
    damping = Rayleigh(2.0 * 0.7 * float(modes.omega[0]), 0.0)
    inertia = float(np.linalg.norm(model.mass @ model.direction("y"))) * 10.0
    transient = Transient(
        model,
        rest,
        modes,
        damping,
        TransientSettings(2e-4, 0.5, tolerance=1e-8, dispersion_correction=False, solver="superlu"),
        force_scale=inertia,
        base_acceleration=lambda _: np.array([10.0]),
        base_direction="y",
    )
    zero = np.zeros((model.n_dof, 1))
    *_, last = transient.march(transient.start(zero, zero), 120)
    pull = -10.0 * (model.mass @ model.direction("y"))
    static = solve_static(model, pull, StaticSettings(steps=1, solver="superlu")).u
    # In 24 ms the bending at 210 Hz with 70 % damping decays by exp(-0.7 * 1320 * 0.024) = 2e-10; rho^120 is less.
    np.testing.assert_allclose(last.state.u[:, 0], static, atol=1e-6 * np.abs(static).max())
    # The base has done twice the work that the sagging beam stores (a suddenly applied load).
    stored = last.energies[:, 0].sum()
    assert last.state.work[2, 0] == pytest.approx(2.0 * stored, rel=1e-5)
    # What the damping has not taken the scheme has: of the order (omega h)^2/12 = 0.6 %.
    assert last.state.work[1, 0] == pytest.approx(stored, rel=6e-3)


def test_step_that_does_not_converge_has_history(strip: Strip) -> None:
    transient = make_transient(strip, max_iterations=2, max_cutbacks=0)
    good: list[StepRecord] = []
    with pytest.raises(FemConvergenceError, match=r"step 1: .*smaller time step") as caught:
        good.extend(transient.march(released(strip, transient), 3))
    assert not good
    assert len(caught.value.history) == 2


def test_nan_stops_at_once(strip: Strip) -> None:
    transient = make_transient(strip)
    broken = np.zeros((strip.model.n_dof, 1))
    broken[np.flatnonzero(strip.model.free)[0]] = np.nan
    state = transient.start(np.zeros_like(broken), np.zeros_like(broken))
    with pytest.raises(FemConvergenceError) as caught:
        list(transient.march(replace(state, u=state.u + broken), 1))
    assert len(caught.value.history) == 1


def test_structure_without_contact_marches() -> None:
    model = single(box((0.2, 0.01, 0.01), (2, 1, 1)), supports=(Support("body.x_min", ("x", "y", "z")),))
    rest = solve_static(model, model.load, StaticSettings(steps=1, solver="superlu"))
    modes = solve_modes(model, rest, 1, solver="superlu")
    settings = TransientSettings(1e-4, corrected_modes=1, solver="superlu")
    transient = Transient(model, rest, modes, Rayleigh(0.0, 0.0), settings, force_scale=1.0)
    zero = np.zeros((model.n_dof, 1))
    (record,) = transient.march(transient.start(zero, zero), 1)
    assert not record.state.work.any()
