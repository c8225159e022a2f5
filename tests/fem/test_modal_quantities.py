"""MAC, participation, effective mass, near-integer ratios; free bodies."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la

from fem.errors import FemConvergenceError
from fem.material import Material
from fem.modal_quantities import (
    effective_masses,
    mac,
    near_integer_ratios,
    participation_factors,
    total_masses,
)
from fem.model import Body, Model, Support, build_model
from fem.modes import ModalBasis, rest_state, solve_modes
from tests.fem.small_models import STEEL, box, single

SIZE = (1.0, 0.2, 0.1)


def _cantilever() -> Model:
    return single(box(SIZE, (4, 1, 1)), supports=(Support("body.x_min", ("x", "y", "z")),))


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_free_body_has_six_rigid_modes_and_the_modes_of_a_free_beam(element: str) -> None:
    """Free-free Euler-Bernoulli beam, 4.7300^2 sqrt(EI/(rho A L^4)); shear lowers it by a few per cent at L/h = 10."""
    model = single(box(SIZE, (8, 2, 1), element))
    modes = solve_modes(model, rest_state(model), 8, solver="superlu", shift_hz=100.0)
    elastic = modes.omega[6]
    assert np.all(modes.omega[:6] < 1e-3 * elastic)
    exact = 4.730041**2 * np.sqrt(STEEL.young_modulus * 0.1**2 / 12.0 / STEEL.density)
    # Timoshenko: -4 % or less at L/h = 10 (half of 12.3 (h/L)^2 (1 + E/(kG)) = 4 %); the mesh adds less than 1 %.
    assert 0.95 * exact < elastic < 1.005 * exact
    rigid = modes.shapes[:, :6]
    # Rigid modes are combinations of rigid motions: E_lin = 0, so no elastic force (relative to that of mode 7).
    force = np.abs(modes.stiffness @ rigid).max()
    assert force < 1e-6 * np.abs(modes.stiffness @ modes.shapes[:, 6]).max()
    # They carry all of the mass and inertia, and the elastic modes none.
    masses = effective_masses(model, modes)
    np.testing.assert_allclose(masses[:6].sum(axis=0), total_masses(model), rtol=1e-6)
    np.testing.assert_allclose(masses[6:], 0.0, atol=1e-6)


def test_total_masses_of_a_box() -> None:
    m = STEEL.density * 0.02
    expected = [m, m, m, m * (0.04 + 0.01) / 12.0, m * (1.0 + 0.01) / 12.0, m * (1.0 + 0.04) / 12.0]
    np.testing.assert_allclose(total_masses(_cantilever()), expected, rtol=1e-12)


def test_effective_mass_of_a_slender_cantilever() -> None:
    """The first bending mode of an Euler-Bernoulli cantilever carries 61.308 % of the mass (Blevins 1979).

    Shear changes it by O((h/L)^2) = 4e-4; nu = 0, since a clamp that hinders lateral strain stiffens the end by
    O(h/L). Tolerance 1e-3.
    """
    mesh = box((1.0, 0.02, 0.04), (20, 1, 1))
    model = single(mesh, Material(2e11, 0.0, 7800.0), supports=(Support("body.x_min", ("x", "y", "z")),))
    modes = solve_modes(model, rest_state(model), 1, solver="superlu")
    assert effective_masses(model, modes)[0, 1] / total_masses(model)[1] == pytest.approx(0.61308, rel=1e-3)


def test_effective_masses_add_up_to_the_mass_that_can_move() -> None:
    """Over all modes sum Gamma^2 = (M b)_f' M_ff^-1 (M b)_f: less than the mass by what the fixed nodes carry."""
    model = single(box(SIZE, (1, 1, 1)), supports=(Support("body.x_min", ("x", "y", "z")),))
    K = model.elastic_tangent(np.zeros(model.n_dof)).toarray()[np.ix_(model.free, model.free)]
    M = model.mass.toarray()
    M_ff = M[np.ix_(model.free, model.free)]
    shapes = np.zeros((model.n_dof, len(K)))
    shapes[model.free] = la.eigh(K, M_ff)[1]
    empty = model.mass * 0.0
    modes = ModalBasis(np.ones(len(K)), shapes, M @ shapes, empty, empty)
    Mb = (M @ model.direction("z"))[model.free]
    whole = Mb @ np.linalg.solve(M_ff, Mb)
    assert effective_masses(model, modes)[:, 2].sum() == pytest.approx(whole, rel=1e-9)
    assert 0.7 * total_masses(model)[2] < whole < total_masses(model)[2]


def test_participation_is_the_load_of_a_base_acceleration() -> None:
    model = _cantilever()
    modes = solve_modes(model, rest_state(model), 3, solver="superlu")
    gamma = participation_factors(model, modes)
    np.testing.assert_allclose(gamma[:, 1], modes.shapes.T @ (model.mass @ model.direction("y")), atol=1e-12)
    assert gamma.shape == (3, 6)


def test_mac_is_one_for_the_same_shape_at_any_scale_and_zero_for_orthogonal_ones() -> None:
    a = np.array([[1.0, 0.0], [2.0, 1.0], [0.0, 0.0]])
    np.testing.assert_allclose(mac(a, -3.0 * a), [[1.0, 0.8], [0.8, 1.0]], atol=1e-15)
    assert mac(a[:, :1], np.array([[0.0], [0.0], [5.0]])) == pytest.approx(0.0)


def test_near_integer_ratios_are_found_closest_first() -> None:
    pairs = near_integer_ratios(np.array([0.0, 10.0, 20.4, 30.0, 44.0]))
    assert [(p.first, p.second, p.low, p.high) for p in pairs] == [
        (1, 3, 1, 3),
        (2, 3, 2, 3),
        (1, 2, 1, 2),
        (3, 4, 2, 3),
        (2, 4, 1, 2),
    ]
    assert pairs[2].detuning == pytest.approx(0.02)


def test_unstable_equilibrium_is_refused_with_a_shift_too() -> None:
    """A free bar under an initial compression beyond buckling has a negative eigenvalue."""
    body = Body("body", box((1.0, 0.05, 0.05), (6, 1, 1)), Material(1e9, 0.0, 1000.0))
    squeezed = Body("body", body.mesh, body.material, initial_stress=np.diag([-5e7, 0.0, 0.0]))
    model = build_model([squeezed], supports=[Support("body.x_min", ("x", "y", "z"))])
    with pytest.raises(FemConvergenceError, match="not positive definite"):
        solve_modes(model, rest_state(model), 2, solver="superlu", shift_hz=1.0)


def test_equal_frequencies_are_one_to_one_and_far_ones_are_not_listed() -> None:
    """2:4 is not listed beside 1:2; 1.75 lies 12 % from 2 and 17 % from 3/2."""
    pairs = near_integer_ratios(np.array([100.0, 100.0, 150.0]))
    assert [(p.first, p.second, p.low, p.high) for p in pairs] == [(0, 1, 1, 1), (0, 2, 2, 3), (1, 2, 2, 3)]
    assert near_integer_ratios(np.array([100.0, 175.0])) == ()
