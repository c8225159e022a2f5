"""Modes about an equilibrium and Rayleigh damping."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la

from fem.errors import FemInputError
from fem.linear_solver import available_solvers
from fem.modes import _signs, damping_ratios, modal_stiffness, rayleigh, solve_modes
from fem.preload import StaticState
from tests.fem.conftest import Strip
from tests.fem.small_models import box, single


def test_modes_equal_a_dense_solution(strip: Strip) -> None:
    model, state = strip.model, strip.equilibrium
    stuck = model.contact.stick_tangent(state.contact.status[:, 0])
    K = (model.elastic_tangent(state.u) + stuck).toarray()[np.ix_(model.free, model.free)]
    M = model.mass.toarray()[np.ix_(model.free, model.free)]
    omega = np.sqrt(la.eigh(0.5 * (K + K.T), M, eigvals_only=True)[:4])
    # Dense eigenvalues err by roundoff times the largest one: 1e-16 * (omega_max / omega_1)^2 = 1e-8.
    np.testing.assert_allclose(strip.modes.omega, omega, rtol=1e-7)


def test_modes_are_mass_normal_and_respect_supports(strip: Strip) -> None:
    modes = strip.modes
    np.testing.assert_allclose(modes.left.T @ modes.shapes, np.eye(4), atol=1e-10)
    np.testing.assert_array_equal(modes.shapes[~strip.model.free], 0.0)
    largest = modes.shapes[np.abs(modes.shapes).argmax(axis=0), np.arange(4)]
    assert np.all(largest > 0.0)


@pytest.mark.parametrize("solver", available_solvers())
def test_solvers_give_the_same_modes(strip: Strip, solver: str) -> None:
    modes = solve_modes(strip.model, strip.equilibrium, 4, solver=solver)
    np.testing.assert_allclose(modes.omega, strip.modes.omega, rtol=1e-9)
    np.testing.assert_allclose(modes.shapes, strip.modes.shapes, atol=1e-7 * np.abs(modes.shapes).max())


def test_rayleigh_gives_the_wanted_ratios_back(strip: Strip) -> None:
    damping = rayleigh(strip.modes, (0, 2), (0.004, 0.01))
    ratios = damping_ratios(strip.modes, damping)
    assert ratios[[0, 2]] == pytest.approx([0.004, 0.01], rel=1e-12)
    C = damping.alpha * strip.model.mass + damping.beta * strip.modes.material
    modal = strip.modes.shapes.T @ (C @ strip.modes.shapes)
    np.testing.assert_allclose(np.diag(modal), 2.0 * ratios * strip.modes.omega, rtol=1e-9)
    # The interface stores a part of the energy of a mode, so that the bodies hold less than omega^2.
    assert np.all(modal_stiffness(strip.modes) < strip.modes.omega**2)


def test_ratios_out_of_reach_are_refused(strip: Strip) -> None:
    with pytest.raises(FemInputError, match="negative Rayleigh"):
        rayleigh(strip.modes, (0, 1), (0.004, 0.4))


def test_free_body_is_refused() -> None:
    model = single(box((1.0, 1.0, 1.0), (1, 1, 1)))
    untouched = model.contact.evaluate(model.contact.relative(np.zeros((model.n_dof, 1))), model.contact.no_slip(1))
    with pytest.raises(FemInputError, match="nothing holds"):
        solve_modes(model, StaticState(np.zeros(model.n_dof), untouched, (), ()), 3, solver="superlu")


def test_signs_do_not_hang_on_rounding() -> None:
    """An antisymmetric shape: rounding makes one of two equal ends the largest, the first stays positive."""
    shape = np.array([[0.2], [-1.0], [0.3], [1.0 + 1e-9]])
    np.testing.assert_array_equal(_signs(shape), [-1.0])
    np.testing.assert_array_equal(_signs(shape * (1.0 + np.array([[0.0], [3e-9], [0.0], [0.0]]))), [-1.0])
    np.testing.assert_array_equal(_signs(np.array([[0.5], [-2.0]])), [-1.0])
