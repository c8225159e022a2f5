"""Contact points that slip or open, brought into equilibrium apart within an iteration on the frozen factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem import interface_equilibrium as apart
from fem.contact import ContactState
from fem.friction import SLIP, STICK
from fem.gmres import TOLERANCE, gmres
from fem.interface_equilibrium import LoosePoints, loose_points, loosened
from tests.fem.conftest import Strip
from tests.fem.test_transient import make_transient, released


def points_of(strip: Strip) -> LoosePoints:
    """All points of the strip on the factor of a step."""
    transient = make_transient(strip)
    equation, mask = transient._equation(0), strip.model.free[:, None]
    factor, weight = transient._preconditioner.rest(0), equation.step**2 * equation.scheme.beta
    weight *= 1.0 - equation.scheme.alpha_f
    closed = strip.equilibrium.contact.status[:, 0] > 0
    every = np.arange(strip.model.contact.n_point)
    return loose_points(strip.model.contact, closed, every, lambda f: weight * mask * factor.solve(mask * f))


def moved(strip: Strip, *, size: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """v at the held strip, the remainder at the equilibrium, and its slip history."""
    contact, slip = strip.model.contact, strip.equilibrium.contact.slip
    v, rest = (contact.relative(u[:, None]) for u in (strip.held.u, strip.equilibrium.u))
    return rest + size * (v - rest), rest, slip


def test_compliance_is_that_of_the_factor(strip: Strip) -> None:
    """(1-af) b h^2 B A^-1 B' by a dense solve; the factor is in single precision, 6e-8."""
    transient = make_transient(strip)
    equation, pre = transient._equation(0), transient._preconditioner
    A = equation.matrix(pre._rest.stiffness, pre._rest.viscous).toarray()
    B = strip.model.contact.operator.toarray() * strip.model.free
    s = equation.scheme
    expected = (1.0 - s.alpha_f) * s.beta * equation.step**2 * B @ np.linalg.solve(A, B.T)
    found = points_of(strip).compliance
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_settled_points_are_in_equilibrium(strip: Strip) -> None:
    """v = v_k - C (phi(v) - phi_k) to the tolerance of Newton's method, with many points slipping.

    The solution v is not returned, but follows from its remainder by the equation itself; what the law then gives
    differs from that remainder by no more than the tolerance lets it.
    """
    points = points_of(strip)
    v, rest, slip = moved(strip)
    applied = points.remainder(rest, slip)
    phi = points.settled(v, applied, slip)
    C = points.compliance.astype(float) * points.weight
    before = np.linalg.norm(C @ (points.remainder(v, slip) - applied))
    there = v - C @ (phi - applied)
    after = np.linalg.norm(C @ (points.remainder(there, slip) - phi))
    assert before > 0.0
    # C times the slope of phi, at most the sticking stiffness, is at most 1: one more turn enlarges nothing
    assert after < 1.1 * apart.NEWTON_TOLERANCE * before


def test_points_that_find_no_equilibrium_keep_their_remainder(strip: Strip) -> None:
    """No compliance, no residual to bring down; and nothing to settle where the remainder is what was applied."""
    points = points_of(strip)
    v, rest, slip = moved(strip)
    applied = points.remainder(rest, slip)
    lost = replace(points, compliance=np.full_like(points.compliance, np.nan))
    np.testing.assert_array_equal(lost.settled(v, applied, slip), points.remainder(v, slip))
    np.testing.assert_array_equal(points.settled(rest, applied, slip), applied)


def test_cases_settle_each_for_itself(strip: Strip) -> None:
    points = points_of(strip)
    (v, rest, slip), (other, _, _) = moved(strip), moved(strip, size=-0.7)
    applied = points.remainder(rest, slip)
    both = points.settled(np.hstack([v, other]), np.hstack([applied, applied]), np.repeat(slip, 2, axis=2))
    for case, own in enumerate((v, other)):
        np.testing.assert_array_equal(both[:, case], points.settled(own, applied, slip)[:, 0])


def test_krylov_steps_solve_a_system() -> None:
    """Identity plus a matrix of norm below 1, as the points have it: 1e-2 of the right-hand side is left at most."""
    rng = np.random.default_rng(3)
    A = np.eye(60) + 0.9 * np.linalg.qr(rng.standard_normal((60, 60)))[0]
    b = rng.standard_normal(60)
    assert np.linalg.norm(A @ gmres(A, b) - b) <= 1.001 * TOLERANCE * np.linalg.norm(b)
    small = A[:3, :3]
    np.testing.assert_allclose(small @ gmres(small, b[:3]), b[:3], atol=0.02)
    np.testing.assert_array_equal(gmres(A, 0.0 * b), 0.0 * b)


def test_points_join_when_enough_of_them_slip(strip: Strip) -> None:
    """One slips, one is at 90 % of its limit, the eight nearest fill the group; a tenth of those known brings none."""
    contact = strip.model.contact
    closed = np.ones(contact.n_point, dtype=bool)
    status = np.full((contact.n_point, 2), STICK)
    status[5, 1] = SLIP
    traction = np.zeros((contact.n_point, 3, 2))
    traction[:, 0] = -1e6
    traction[9, 2, 0] = 0.9e6 * contact.law[9, 2]
    nearest = np.array([11, 17, 3, 4, 8, 1, 0, 16])
    traction[nearest, 2, 0] = np.linspace(0.7e6, 0.1e6, 8) * contact.law[nearest, 2]
    state = ContactState(traction.reshape(-1, 2), strip.equilibrium.contact.slip, status)
    none = np.array([], dtype=np.int64)
    np.testing.assert_array_equal(loosened(none, contact, state, closed), [5, 9, *nearest])
    known = np.setdiff1d(np.arange(18), [5])
    np.testing.assert_array_equal(loosened(known, contact, state, closed), known)
    assert not len(loosened(none, contact, replace(state, status=np.full_like(status, STICK)), closed))


def test_compliance_grows_to_the_same_bits(strip: Strip) -> None:
    """Group after group as the march finds them, or all at once as a restart does."""
    transient = make_transient(strip)
    order = np.random.default_rng(2).permutation(strip.model.contact.n_point)
    pre = transient._preconditioner
    grown = [pre.loose(order[:n]) for n in (apart.GROUP, len(order))]
    pre._loose = None
    whole = pre.loose(order)
    assert whole is not None
    assert grown[1] is not None
    np.testing.assert_array_equal(grown[1].compliance, whole.compliance)


def test_too_many_points_are_left_to_the_outer_iteration(strip: Strip, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "LARGEST", 3)
    contact = strip.model.contact
    state = replace(strip.equilibrium.contact, status=np.full((contact.n_point, 1), SLIP))
    assert len(loosened(np.array([], dtype=np.int64), contact, state, np.ones(contact.n_point, dtype=bool))) == 3


def test_slipping_steps_take_fewer_iterations_to_the_same_motion(strip: Strip) -> None:
    """80 steps at 1e-5 of the peak inertia force; the paths part by the tolerance of every step, see the fast path."""
    motion, iterations = [], []
    for together in (False, True):
        transient = make_transient(strip, tolerance=1e-5, interface_equilibrium=together, time_step=2e-4)
        records = list(transient.march(released(strip, transient), 80))
        motion.append(np.array([r.state.u[:, 0] for r in records]))
        iterations.append(sum(int(r.iterations[0]) for r in records))
        assert (len(records[-1].state.pace.loose) > 0) == together
    shift = np.abs(strip.held.u - strip.equilibrium.u).max()
    np.testing.assert_allclose(motion[1], motion[0], atol=0.5 * 80**2 * 1e-5 * shift)
    assert iterations[1] < 0.9 * iterations[0]


def test_a_case_with_its_own_factor_does_not_hold_up_the_others(strip: Strip) -> None:
    """Two cases, the second anchored from the start: the first iterates as beside a plain one."""
    transient = make_transient(strip, tolerance=1e-5, time_step=2e-4, refactor_above=0)
    alone = released(strip, transient)
    both = np.repeat(alone.u - strip.equilibrium.u[:, None], 2, axis=1)
    start = transient.start(both, 0.0 * both, np.repeat(strip.held.contact.slip, 2, axis=2), settled=True)
    case = np.array([1])
    anchors = replace(start.pace, anchored=case, anchor_u=start.u[:, case], anchor_slip=start.slip[:, :, case])
    counts = []
    for state in (start, replace(start, pace=anchors)):
        records = list(transient.march(state, 40))
        counts.append(sum(int(r.iterations[0]) for r in records))
        assert len(records[-1].state.pace.loose) > 0
    assert counts[1] == pytest.approx(counts[0], rel=0.02)
