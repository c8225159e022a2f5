"""Campaigns: segments, restarts bit by bit, rows that agree with the states."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from fem.campaign import CampaignSegment, Observation, Starts, march_campaign, modal_starts, snap_back_starts
from fem.errors import FemInputError
from fem.sensor import Sensor, sensor_rows
from tests.fem.conftest import Strip
from tests.fem.test_transient import STEP, make_transient
from tests.records import same


def _observation(strip: Strip) -> Observation:
    return Observation(strip.modes, sensor_rows(strip.model, [Sensor("mid", (0.0, 0.0, 0.01), "y")]), 4)


def _march(strip: Strip, n_step: int, segment: int) -> list[CampaignSegment]:
    transient = make_transient(strip)
    first = (strip.held.u - strip.equilibrium.u)[:, None]
    second = modal_starts(strip.modes, strip.equilibrium, [np.array([-1e-6])])
    starts = Starts(
        np.hstack([first, second.displacement]), np.concatenate([strip.held.contact.slip, second.slip], axis=2)
    )
    return list(march_campaign(transient, _observation(strip), n_step, segment, starts=starts))


def test_segments_cover_all_steps_once(strip: Strip) -> None:
    segments = _march(strip, 10, 4)
    np.testing.assert_array_equal(np.concatenate([s.steps for s in segments]), np.arange(11))
    assert [len(s.steps) for s in segments] == [5, 4, 2]
    np.testing.assert_array_equal(np.concatenate([s.snapshot_steps for s in segments]), [0, 4, 8])
    assert segments[0].snapshots.shape == (2, strip.model.n_dof, 2)
    assert segments[2].snapshots.shape == (0, strip.model.n_dof, 2)


def test_restart_repeats_the_uninterrupted_run_bit_by_bit(strip: Strip) -> None:
    """A fresh transient continues from the state of a segment, as after a kill."""
    whole = _march(strip, 10, 4)
    transient = make_transient(strip)
    rest = list(march_campaign(transient, _observation(strip), 10, 4, restart=whole[0].state))
    assert len(rest) == 2
    for again, first in zip(rest, whole[1:], strict=True):
        assert same(again, first)


def test_segment_length_does_not_change_the_numbers(strip: Strip) -> None:
    short, whole = _march(strip, 9, 3), _march(strip, 9, 9)
    for field in fields(CampaignSegment):
        if field.name != "state":
            joined = np.concatenate([getattr(s, field.name) for s in short])
            np.testing.assert_array_equal(joined, getattr(whole[0], field.name))


def test_rows_agree_with_each_other(strip: Strip) -> None:
    (segment,) = _march(strip, 8, 8)
    model, modes = strip.model, strip.modes
    eta = np.einsum("nm,snc->smc", modes.left, segment.snapshots.astype(float))
    # Snapshots are single precision.
    np.testing.assert_allclose(eta, segment.eta[[0, 4, 8]], atol=1e-6 * np.abs(segment.eta).max())
    np.testing.assert_allclose(segment.eta[0, 0], [strip.eta, -1e-6], rtol=1e-8)
    sensor = _observation(strip).sensors[0]
    assert segment.displacement[0, 0, 1] == pytest.approx(-1e-6 * (sensor @ modes.shapes[:, 0]), rel=1e-9)
    moved = segment.state.u - strip.equilibrium.u[:, None]
    np.testing.assert_allclose(segment.eta[-1], modes.left.T @ moved, atol=1e-15)
    np.testing.assert_array_equal(moved[~model.free], 0.0)
    # Velocity and acceleration belong to the displacement: second-order differences of a 443 Hz motion.
    difference = (segment.eta[2:, 0] - segment.eta[:-2, 0]) / (2.0 * STEP)
    wh = strip.modes.omega[0] * STEP
    np.testing.assert_allclose(segment.eta_dot[1:-1, 0], difference, atol=wh**2 * np.abs(segment.eta_dot).max())
    curvature = (segment.eta[2:, 0] - 2.0 * segment.eta[1:-1, 0] + segment.eta[:-2, 0]) / STEP**2
    np.testing.assert_allclose(segment.eta_ddot[1:-1, 0], curvature, atol=wh * np.abs(curvature).max())


def test_snap_back_starts_keep_slip_of_every_case(strip: Strip) -> None:
    transient = make_transient(strip)
    seen: list[float] = []
    starts = snap_back_starts(transient, strip.modes, [np.array([1e-4]), np.array([-2e-5])], progress=seen.append)
    reached = strip.modes.left[:, 0] @ starts.displacement
    np.testing.assert_allclose(reached, [1e-4, -2e-5], rtol=1e-8)
    assert starts.slip.shape == (strip.model.contact.n_point, 2, 2)
    assert seen == pytest.approx([0.5, 1.0])


def test_campaign_without_any_start_is_refused(strip: Strip) -> None:
    transient = make_transient(strip)
    with pytest.raises(FemInputError, match="starts or a restart"):
        list(march_campaign(transient, _observation(strip), 4, 4))
