"""Motions counted from where they come to rest: offsets found, said and taken off; motions that still move refused."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.model_stages import share_out
from romgen.rest_position import counted_from, offset_percent, rest_position
from romgen.settings import DataSettings
from romgen.trajectory import Trajectory
from romgen.trajectory_files import write_trajectories

OFFSET = np.array([2e-5, -1e-5])


def decay(t: FloatArray, rate: float) -> Trajectory:
    """Two sensors, 1 mm and 0.6 mm at 25 Hz and its double, about OFFSET."""
    shape = np.exp(-rate * t)[:, None] * np.column_stack([np.cos(157.0 * t), 0.6 * np.cos(314.0 * t)])
    return Trajectory("decay", t, ("tip", "mid"), 1e-3 * shape + OFFSET)


@pytest.mark.parametrize("irregular", [False, True])
def test_offset_is_found_beside_what_still_moves(irregular: bool) -> None:
    """After 1.8 s 0.45 % still moves, 4.5 um. Over n = 5 periods a Hann window leaves 1 / (pi n (n^2 - 1)) of it.

    That is 0.3 %, 0.012 um, and the decay within the window as much again; four times that is allowed.
    """
    t = np.linspace(0.0, 2.0, 4001)
    if irregular:
        t[1:-1] += np.random.default_rng(2).uniform(-2e-4, 2e-4, t.size - 2)
    motion = decay(t, 3.0)
    rest = rest_position(motion)
    assert np.abs(rest - OFFSET).max() < 4 * 1.2e-8
    assert offset_percent(motion, rest) == pytest.approx(100 * np.linalg.norm(OFFSET) / np.hypot(1e-3, 6e-4), rel=0.01)
    assert np.abs(rest_position(counted_from(motion, rest))).max() < 1e-18


def test_motion_that_still_moves_is_refused() -> None:
    with pytest.raises(InputError, match="has not come to rest") as caught:
        rest_position(decay(np.linspace(0.0, 2.0, 4001), 1.0))
    assert "record longer" in str(caught.value)


def test_study_counts_from_rest_on_request_and_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    motion = decay(np.linspace(0.0, 2.0, 4001), 3.0)
    write_trajectories(tmp_path / "decay.h5", [motion])
    settings = DataSettings(files=(tmp_path / "decay.h5",), sensors=motion.sensors, training=(0,))
    assert np.array_equal(share_out(settings).training[0].displacement, motion.displacement)
    with caplog.at_level(logging.INFO):
        found = share_out(settings.model_copy(update={"zero": "rest"})).training[0]
    assert np.abs(found.displacement - (motion.displacement - OFFSET)).max() < 4 * 1.2e-8
    assert "1.9 % of its largest motion off its recorded zero" in caplog.text
