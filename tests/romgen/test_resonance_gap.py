"""The gap of the detunings where there is none."""

from __future__ import annotations

import numpy as np

from romgen.polynomial import exponents
from romgen.resonance import automatic_resonance, gap_resonance


def test_one_mode_at_order_two_has_no_gap_of_detunings() -> None:
    """z^2, z conj z and conj z^2 are all detuned by the frequency or more: nothing but z itself is resonant."""
    eigenvalue, table = np.array([-2.0 + 700.0j]), exponents(2, 2, 2)
    for choose in (automatic_resonance, gap_resonance):
        assert not choose(eigenvalue, table).resonant.any()
