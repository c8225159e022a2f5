"""The contact law at one point: return mapping, cone, tangent, dissipation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem.friction import OPEN, SLIP, STICK, return_map, traction_tangents, tractions

KN, KT, MU = 5.0, 3.0, 0.4
# Below 1e-100 squares run out of exponents: no displacement in m is that small.
number = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: x if abs(x) > 1e-100 else 0.0)


def _law(relative: np.ndarray, slip: np.ndarray, mu: float = MU) -> tuple[np.ndarray, np.ndarray, int]:
    traction, new_slip, status = np.empty((3, 1)), np.empty((1, 2, 1)), np.empty((1, 1), dtype=np.int64)
    law = np.array([[KN, KT, mu]])
    tractions(np.zeros(1), law, relative.reshape(3, 1), slip.reshape(1, 2, 1), traction, new_slip, status)
    return traction[:, 0], new_slip[0, :, 0], int(status[0, 0])


def test_stick_slip_and_open_by_hand() -> None:
    assert return_map(-0.1, 0.02, 0.0, 0.0, 0.0, KN, KT, MU) == pytest.approx((-0.5, 0.06, 0.0, 0.0, 0.0, STICK))
    # Trial 3 * (0.3, 0.4) = (0.9, 1.2), size 1.5, limit 0.4 * 0.5 = 0.2: traction (0.12, 0.16), anchor s - t/kt.
    slipped = return_map(-0.1, 0.3, 0.4, 0.0, 0.0, KN, KT, MU)
    assert slipped == pytest.approx((-0.5, 0.12, 0.16, 0.26, 0.4 - 0.16 / 3.0, SLIP))
    assert return_map(0.1, 0.3, 0.4, 0.0, 0.0, KN, KT, MU) == (0.0, 0.0, 0.0, 0.3, 0.4, OPEN)
    assert return_map(0.0, 0.3, 0.4, 0.0, 0.0, KN, KT, MU)[5] == OPEN


def test_frictionless_point_carries_no_shear() -> None:
    tn, t1, t2, _, _, _ = return_map(-0.1, 0.3, -0.4, 0.0, 0.0, KN, KT, 0.0)
    assert (tn, t1, t2) == (-0.5, 0.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(number, number, number, number, number)
def test_cone_history_and_dissipation(gap: float, s1: float, s2: float, p1: float, p2: float) -> None:
    slip = np.array([p1, p2])
    traction, new_slip, status = _law(np.array([gap, s1, s2]), slip)
    pressure, shear = -traction[0], traction[1:]
    assert pressure >= 0.0
    assert np.linalg.norm(shear) <= MU * pressure * (1.0 + 1e-14)
    # Anchored spring: the traction is that of the new anchor, so that a second evaluation changes nothing but roundoff.
    if status != OPEN:
        np.testing.assert_allclose(shear, KT * (np.array([s1, s2]) - new_slip), atol=1e-14)
    again, _, _ = _law(np.array([gap, s1, s2]), new_slip)
    np.testing.assert_allclose(again, traction, atol=1e-14)
    assert shear @ (new_slip - slip) >= -1e-16


@settings(max_examples=60, deadline=None)
@given(st.floats(-1.0, -0.05), number, number, number, number, st.sampled_from([0.0, 0.05, 0.4]))
def test_tangent_equals_central_differences(gap: float, s1: float, s2: float, p1: float, p2: float, mu: float) -> None:
    relative, slip, h = np.array([gap, s1, s2]), np.array([p1, p2]), 1e-6
    trial, limit = KT * np.hypot(s1 - p1, s2 - p2), -mu * KN * gap
    if abs(trial - limit) < 1e-3 or trial < 1e-3:
        return  # The law has a corner at the cone, and none of its slopes is defined at zero trial and zero limit.
    tangent = np.empty((1, 3, 3))
    traction_tangents(np.zeros(1), np.array([[KN, KT, mu]]), relative, slip.reshape(1, 2), tangent)
    for j in range(3):
        step = h * np.eye(3)[j]
        difference = (_law(relative + step, slip, mu)[0] - _law(relative - step, slip, mu)[0]) / (2.0 * h)
        # Truncation h^2/6 times a third derivative below limit kt^3/trial^3 (6e10 h^2/6 at worst 1e-2 of kt), scaled.
        scale = 1.0 + (limit / trial) * (KT / trial) ** 2
        np.testing.assert_allclose(tangent[0, :, j], difference, atol=1e-8 * scale)


def test_open_point_has_no_stiffness() -> None:
    tangent = np.ones((1, 3, 3))
    traction_tangents(np.zeros(1), np.array([[KN, KT, MU]]), np.array([0.1, 0.0, 0.0]), np.zeros((1, 2)), tangent)
    np.testing.assert_array_equal(tangent, 0.0)
