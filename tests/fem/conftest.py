"""One small preloaded structure for the tests of statics and dynamics."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from fem.model import Model
from fem.modes import ModalBasis, Rayleigh, rayleigh, solve_modes
from fem.preload import StaticSettings, StaticState, solve_static
from tests.fem.small_models import clamped_strip


@dataclass(frozen=True)
class Strip:
    """The clamped strip, its equilibrium, four modes and damping."""

    model: Model
    equilibrium: StaticState
    modes: ModalBasis
    damping: Rayleigh


@pytest.fixture(scope="session")
def strip() -> Strip:
    """Strip with SuperLU, so that the tests also run without MKL."""
    model = clamped_strip()
    equilibrium = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    modes = solve_modes(model, equilibrium, 4, solver="superlu")
    return Strip(model, equilibrium, modes, rayleigh(modes, (0, 1), (0.004, 0.004)))
