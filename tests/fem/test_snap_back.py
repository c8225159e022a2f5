"""Static states that hold wanted modal coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from fem.campaign import modal_coordinates
from fem.errors import FemConvergenceError
from fem.snap_back import hold_modes
from tests.fem.conftest import Strip


def test_held_state_reaches_eta_and_balances(strip: Strip) -> None:
    """Phi' M (u - u_s) = eta, and what is out of balance lies along the modal load M Phi alone."""
    model, modes = strip.model, strip.modes
    eta = modal_coordinates(modes, (1e-3, 2e-5))
    seen: list[float] = []
    state = hold_modes(model, strip.equilibrium, modes, eta, steps=4, solver="superlu", progress=seen.append)
    reached = modes.left[:, :2].T @ (state.u - strip.equilibrium.u)
    np.testing.assert_allclose(reached, eta, atol=1e-9 * np.abs(eta).max())
    force = model.elastic_force(state.u[:, None])[0] + model.contact.force(state.contact.traction)
    missing = np.where(model.free, force[:, 0] - model.load, 0.0)
    left = modes.left[:, :2] * model.free[:, None]
    c = np.linalg.lstsq(left, missing, rcond=None)[0]
    scale = np.linalg.norm(left @ (modes.omega[:2] ** 2 * eta))
    assert np.linalg.norm(missing - left @ c) < 2e-6 * scale
    # Stretching stiffens: the load that holds mode 1 exceeds the linear one.
    assert c[0] > modes.omega[0] ** 2 * eta[0]
    assert seen == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_small_state_is_the_mode(strip: Strip) -> None:
    """At 1 micrometre all points stick and the held state is the linear mode to first order."""
    eta = modal_coordinates(strip.modes, (1e-6,))
    state = hold_modes(strip.model, strip.equilibrium, strip.modes, eta, steps=1, solver="superlu")
    shape = strip.modes.shapes[:, 0] * eta[0]
    np.testing.assert_allclose(state.u - strip.equilibrium.u, shape, atol=3e-3 * np.abs(shape).max())


def test_too_large_a_step_fails_with_its_history(strip: Strip) -> None:
    eta = modal_coordinates(strip.modes, (2e-3,))
    with pytest.raises(FemConvergenceError, match="smaller amplitude or more steps") as caught:
        hold_modes(strip.model, strip.equilibrium, strip.modes, eta, steps=1, max_iterations=2, solver="superlu")
    assert len(caught.value.history) == 2


def test_modal_coordinates_give_the_wanted_peak(strip: Strip) -> None:
    eta = modal_coordinates(strip.modes, (1e-3, 0.0, 2e-3))
    for mode, peak in ((0, 1e-3), (2, 2e-3)):
        field = (strip.modes.shapes[:, mode] * eta[mode]).reshape(-1, 3)
        assert np.linalg.norm(field, axis=1).max() == pytest.approx(peak, rel=1e-12)
    assert eta[1] == 0.0
