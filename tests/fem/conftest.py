"""One small preloaded structure for the tests of statics and dynamics."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from fem.campaign import modal_coordinates
from fem.model import Model
from fem.modes import ModalBasis, Rayleigh, rayleigh, solve_modes
from fem.preload import StaticSettings, StaticState, solve_static
from fem.snap_back import hold_modes
from tests.fem.small_models import clamped_strip


@dataclass(frozen=True)
class Strip:
    """The clamped strip, its equilibrium, four modes, damping, and its first mode held at a peak of 1 mm."""

    model: Model
    equilibrium: StaticState
    modes: ModalBasis
    damping: Rayleigh
    held: StaticState
    eta: float


@pytest.fixture(scope="session")
def strip() -> Strip:
    """Strip with SuperLU, so that the tests also run without MKL."""
    model = clamped_strip()
    equilibrium = solve_static(model, model.load, StaticSettings(steps=2, solver="superlu"))
    modes = solve_modes(model, equilibrium, 4, solver="superlu")
    eta = modal_coordinates(modes, (1e-3,))
    held = hold_modes(model, equilibrium, modes, eta, steps=4, solver="superlu")
    return Strip(model, equilibrium, modes, rayleigh(modes, (0, 1), (0.004, 0.004)), held, float(eta[0]))
