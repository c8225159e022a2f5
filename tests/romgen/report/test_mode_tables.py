"""Table of near-integer frequency ratios."""

from __future__ import annotations

from romgen.report.mode_tables import ratio_table
from romgen.structure import Modes


def test_ratios_are_listed_with_signed_detuning(modes: Modes) -> None:
    """198.8 / 109.7 = 1.8122 is 9.39 % below 2."""
    assert ratio_table(modes).rows == (("1 and 2", "1:2", "1.8122", "-9.39"),)
