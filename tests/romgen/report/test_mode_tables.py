"""Near-integer frequency ratios."""

from __future__ import annotations

import numpy as np
import pytest

from romgen.report.mode_tables import near_integer_ratios


def test_finds_one_to_two_with_signed_detuning() -> None:
    """f2 = 2 f1 (1 - 0.03) is 1:2 at -3 %, nothing else."""
    (found,) = near_integer_ratios(np.array([100.0, 194.0]))
    assert found[:4] == (0, 1, 1, 2)
    assert found[4] == pytest.approx(-0.03)


def test_twins_and_two_to_three() -> None:
    """Equal frequencies are 1:1; 2:4 is not listed beside 1:2."""
    found = near_integer_ratios(np.array([100.0, 100.0, 150.0]))
    assert [pair[:4] for pair in found] == [(0, 1, 1, 1), (0, 2, 2, 3), (1, 2, 2, 3)]


def test_far_ratios_are_not_resonant() -> None:
    """1.75 lies 12 % from 2 and 17 % from 3/2."""
    assert near_integer_ratios(np.array([100.0, 175.0])) == []
