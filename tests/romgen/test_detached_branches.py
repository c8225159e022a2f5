"""The search for further branches: reproducible starts, nothing found twice."""

from __future__ import annotations

import numpy as np

from romgen.branch import ContinuationSettings
from romgen.continuation import continue_branch
from romgen.detached_branches import crossing_starts, detached_branches, random_starts
from romgen.forcing import harmonic_load
from romgen.rotating_frame import rotating_frame
from tests.normal_form_models import averaged_oscillator, resonant_pair

LARGEST = np.array([1.0, 0.5])


def test_random_starts_are_reproducible_and_inside() -> None:
    starts = random_starts(LARGEST, (1.0, 2.0), 3, 50)
    again = random_starts(LARGEST, (1.0, 2.0), 3, 50)
    q = np.array([q for q, _ in starts])
    np.testing.assert_array_equal(q, [q for q, _ in again])
    assert sorted({omega for _, omega in starts}) == [1.0, 1.5, 2.0]
    assert np.all(np.abs(q) <= LARGEST)
    assert np.all(np.abs(q).max(axis=0) > 0.9 * LARGEST)


def test_all_three_solutions_of_a_bent_peak_belong_to_one_branch() -> None:
    model = averaged_oscillator(0.2j, damping=0.02)
    frame = rotating_frame(model, harmonic_load(model, "load", 0.02), 0)
    settings = ContinuationSettings((0.9, 1.3), state_scale=0.5, parameter_scale=0.02)
    main = continue_branch(frame, frame.start(frame.linear_response(0.9), 0.9), 0.9, settings)
    assert len(main.located("fold")) == 2
    starts = [(frame.start(q, omega), omega) for q, omega in random_starts(np.ones(1), (0.9, 1.3), 9, 20)]
    assert detached_branches(frame, [main], starts, np.ones(1), settings) == []


def test_branch_through_a_pitchfork_is_found_once() -> None:
    """Both branch points of the direct response lead to the same subharmonic, whose mirror image is the same motion."""
    model = resonant_pair(0.1, 0.01)
    frame = rotating_frame(model, harmonic_load(model, "load", 0.02), 1)
    settings = ContinuationSettings((1.9, 2.1), state_scale=0.25, parameter_scale=0.04)
    main = continue_branch(frame, frame.start(frame.linear_response(1.9), 1.9), 1.9, settings)
    starts = crossing_starts(frame, [main], settings)
    assert len(starts) == 2
    (found,) = detached_branches(frame, [main], starts, np.ones(2), settings)
    assert np.abs(frame.modal(found.x)[:, 0]).max() > 0.1


def test_rounding_at_the_end_of_the_range_makes_no_new_branch() -> None:
    """A solution a rounding error beyond the last frequency of a branch is on that branch."""
    model = averaged_oscillator(0.2j, damping=0.02)
    frame = rotating_frame(model, harmonic_load(model, "load", 0.02), 0)
    settings = ContinuationSettings((0.9, 1.3), state_scale=0.5, parameter_scale=0.02)
    main = continue_branch(frame, frame.start(frame.linear_response(0.9), 0.9), 0.9, settings)
    last = int(main.p.argmax())
    starts = [(main.x[last], float(main.p[last]) * (1.0 + 4e-16))]
    assert detached_branches(frame, [main], starts, np.ones(1), settings) == []
