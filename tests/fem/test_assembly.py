"""Kernels and assembly: tangents, energy, an independent assembly, batches, threads, mass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, eye, grad, mul, trace, transpose

from fem.element import reference_element
from fem.errors import FemInputError
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Model, build_model
from tests.fem.small_models import STEEL, box, distorted, single, wave

ELEMENTS = ("hex20", "hex27", "tet10")
_CASES = {name: single(distorted(box((1.0, 0.8, 0.6), (2, 1, 1), name), 0.05)) for name in ELEMENTS}


def _force(model: Model, u: np.ndarray) -> np.ndarray:
    return model.elastic_force(u[:, None])[0][:, 0]


@pytest.mark.parametrize("element", ELEMENTS)
def test_tangent_is_the_derivative_of_the_force(element: str) -> None:
    """The force is a cubic polynomial: the central difference errs by its third-order part times t^2.

    Richardson's combination of t and t/2 removes that part exactly; what is left is roundoff.
    """
    model = _CASES[element]
    u, d = wave(model.points, 0.2), np.random.default_rng(1).standard_normal(model.n_dof)
    d *= 0.1 / np.abs(d).max()

    def difference(t: float) -> np.ndarray:
        return np.asarray((_force(model, u + t * d) - _force(model, u - t * d)) / (2.0 * t))

    expected = (4.0 * difference(0.5) - difference(1.0)) / 3.0
    np.testing.assert_allclose(model.elastic_tangent(u) @ d, expected, atol=1e-12 * np.abs(expected).max())


def _prestressed(element: str) -> Model:
    """The distorted mesh with another initial stress in every cell, of the size of the elastic one."""
    body = _CASES[element].bodies[0]
    stress = np.random.default_rng(5).standard_normal((len(body.mesh.cells), 3, 3)) * 0.1 * STEEL.young_modulus
    return build_model([replace(body, initial_stress=stress + np.swapaxes(stress, 1, 2))])


@pytest.mark.parametrize("element", ELEMENTS)
def test_initial_stress_enters_force_tangent_and_energy(element: str) -> None:
    """Force = gradient of the energy and tangent = gradient of the force, both by exact differences of polynomials.

    Along a line the energy is of fourth order and the force of third, so that Richardson's combination of two central
    differences is exact for both; what is left is roundoff.
    """
    model = _prestressed(element)
    u, d = wave(model.points, 0.1), np.random.default_rng(1).standard_normal(model.n_dof)
    d *= 0.1 / np.abs(d).max()

    def central(t: float) -> tuple[np.ndarray, float]:
        plus, minus = (model.elastic_force((u + s * t * d)[:, None]) for s in (1.0, -1.0))
        return (plus[0] - minus[0])[:, 0] / (2.0 * t), float(plus[1][0] - minus[1][0]) / (2.0 * t)

    (half, slope_half), (full, slope_full) = central(0.5), central(1.0)
    expected = (4.0 * half - full) / 3.0
    np.testing.assert_allclose(model.elastic_tangent(u) @ d, expected, atol=1e-12 * np.abs(expected).max())
    assert _force(model, u) @ d == pytest.approx((4.0 * slope_half - slope_full) / 3.0, rel=1e-11)


@pytest.mark.parametrize("element", ELEMENTS)
def test_initial_stress_at_rest_has_the_resultant_of_the_stress(element: str) -> None:
    """At u = 0 a uniform S_0 is held by S_0 n on the faces: 7e7 Pa pulls on 0.8 m x 0.6 m along x."""
    mesh = box((1.0, 0.8, 0.6), (2, 1, 1), element)
    stress = np.diag([7e7, 0.0, 0.0])
    model = build_model([replace(_CASES[element].bodies[0], mesh=mesh, initial_stress=stress)])
    force = _force(model, np.zeros(model.n_dof)).reshape(-1, 3)
    assert force[mesh.nodes("x_max")].sum(axis=0) == pytest.approx([7e7 * 0.48, 0.0, 0.0], abs=1e-7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"initial_stress": np.zeros(6)}, "not an initial stress"),
        ({"initial_stress": np.diag([np.nan, 0.0, 0.0])}, "not an initial stress"),
        ({"initial_stress": np.triu(np.ones((3, 3)))}, "not symmetric"),
        ({"initial_stress": np.eye(3), "kinematics": "linear"}, "linear body"),
    ],
)
def test_initial_stress_that_makes_no_sense_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        replace(_CASES["hex20"].bodies[0], **change)


@pytest.mark.parametrize("element", ELEMENTS)
def test_lumped_mass_is_positive_and_keeps_mass_and_a_constant_acceleration(element: str) -> None:
    """HRZ keeps the mass of every cell; on a box its first moment too, so that gravity has no moment."""
    box_model = single(box((1.0, 0.8, 0.6), (2, 1, 1), element))
    for model in (_CASES[element], box_model):
        lumped = model.lumped_mass()
        assert np.all(lumped > 0.0)
        assert lumped.sum() / 3.0 == pytest.approx(STEEL.density * model.nonlinear[0].weights.sum(), rel=1e-12)
    centre = lumped[::3] @ box_model.points / lumped[::3].sum()
    assert centre == pytest.approx([0.5, 0.4, 0.3], abs=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_viscous_force_is_beta_times_the_material_tangent(element: str) -> None:
    """S_v = beta C:E' with E' = sym(F' grad v) makes the nodal force beta K_material(u) v at any u, exactly."""
    model = _CASES[element]
    u, v = wave(model.points, 0.2), np.random.default_rng(4).standard_normal(model.n_dof)
    viscous = model.body_forces(u[:, None], v[:, None], 0.3)[1][:, 0]
    expected = 0.3 * (model.elastic_tangent(u, geometric=False) @ v)
    np.testing.assert_allclose(viscous, expected, atol=1e-13 * np.abs(expected).max())
    assert viscous @ v > 0.0


@pytest.mark.parametrize("element", ELEMENTS)
def test_rigid_spin_is_not_damped(element: str) -> None:
    """v = w x (x + u) of a body that is already strained and rotated: E' = 0; roundoff of the largest term."""
    model = _CASES[element]
    u = wave(model.points, 0.2)
    v = np.cross([0.3, -1.2, 0.7], model.points + u.reshape(-1, 3)).ravel()
    still, moving = (model.body_forces(u[:, None], w[:, None], 1.0)[1] for w in (v, np.abs(v)))
    assert np.abs(still).max() < 1e-13 * np.abs(moving).max()


@pytest.mark.parametrize("element", ELEMENTS)
def test_tangent_is_symmetric(element: str) -> None:
    model = _CASES[element]
    tangent = model.elastic_tangent(wave(model.points, 0.2))
    assert abs(tangent - tangent.T).max() <= 1e-14 * abs(tangent).max()


@pytest.mark.parametrize("element", ELEMENTS)
def test_force_is_the_gradient_of_the_energy(element: str) -> None:
    """The energy is a quartic polynomial: central differences at t and t/2 give its derivative exactly."""
    model = _CASES[element]
    u, d = wave(model.points, 0.2), np.random.default_rng(2).standard_normal(model.n_dof)
    d *= 0.1 / np.abs(d).max()

    def difference(t: float) -> float:
        pair = model.elastic_force(np.column_stack([u + t * d, u - t * d]))[1]
        return float(pair[0] - pair[1]) / (2.0 * t)

    expected = (4.0 * difference(0.5) - difference(1.0)) / 3.0
    assert _force(model, u) @ d == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("element", ELEMENTS)
def test_stiffness_has_six_zero_eigenvalues(element: str) -> None:
    """Full rank of the integration rule on one cell: rigid motions only."""
    mesh = distorted(box((1.0, 0.8, 0.6), (1, 1, 1), element), 0.05)
    one = Mesh(mesh.points[mesh.cells[0]], np.arange(mesh.cells.shape[1])[None], element, {})
    model = single(one)
    values = np.linalg.eigvalsh(model.elastic_tangent(np.zeros(model.n_dof)).toarray())
    assert np.all(np.abs(values[:6]) < 1e-12 * values[-1])
    assert values[6] > 1e-5 * values[-1]


def _scikit_fem_basis(mesh: Mesh) -> skfem.CellBasis:
    reference = reference_element(mesh.element)
    if mesh.element == "tet10":
        n_corner, kind, scalar = 4, skfem.MeshTet, skfem.ElementTetP2()
    else:
        n_corner, kind = 8, skfem.MeshHex
        scalar = skfem.ElementHexS2() if mesh.element == "hex20" else skfem.ElementHex2()
    corners, cells = np.unique(mesh.cells[:, :n_corner], return_inverse=True)
    cells = cells.reshape(-1, n_corner)
    if n_corner == 8:
        order = skfem.ElementHex1().doflocs[:, None, :] - reference.nodes[None, :8]
        cells = cells[:, np.abs(order).max(axis=2).argmin(axis=1)]
    x, w = reference.stiffness_rule()
    other = kind(np.ascontiguousarray(mesh.points[corners].T), np.ascontiguousarray(cells.T))
    return skfem.CellBasis(other, skfem.ElementVector(scalar), quadrature=(np.ascontiguousarray(x.T), w))


def _green_lagrange(v: Any, w: Any) -> Any:
    """Integrand P : grad v of St. Venant and Kirchhoff, written with the helpers of scikit-fem."""
    identity = eye(1.0 + 0.0 * w.x[0], 3)
    F = grad(w["u"]) + identity
    E = 0.5 * (mul(transpose(F), F) - identity)
    S = STEEL.lame_lambda * eye(trace(E), 3) + 2.0 * STEEL.shear_modulus * E
    return ddot(mul(F, S), grad(v))


@pytest.mark.parametrize("element", ELEMENTS)
def test_force_equals_a_scikit_fem_assembly(element: str) -> None:
    model = _CASES[element]
    basis = _scikit_fem_basis(model.bodies[0].mesh)
    ours = np.array(
        [3 * np.linalg.norm(model.points - p, axis=1).argmin() + component for p, component in _locations(basis)]
    )
    assert len(np.unique(ours)) == model.n_dof
    u = wave(model.points, 0.2)
    expected = skfem.LinearForm(_green_lagrange).assemble(basis, u=basis.interpolate(u[ours]))
    force = _force(model, u)[ours]
    np.testing.assert_allclose(force, expected, atol=1e-12 * np.abs(expected).max())


def _locations(basis: skfem.CellBasis) -> list[tuple[np.ndarray, int]]:
    component = np.empty(basis.N, dtype=int)
    for table in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        for row, numbers in enumerate(table):
            component[numbers] = row % 3
    return [(basis.doflocs[:, i], int(component[i])) for i in range(basis.N)]


@pytest.mark.parametrize("element", ELEMENTS)
def test_batch_of_cases_equals_single_cases(element: str) -> None:
    """Same operations per case; vectorised sums may round differently: a few hundred units in the last place."""
    model = _CASES[element]
    u = np.column_stack([wave(model.points, s) for s in (0.2, -0.1, 0.01)])
    force, energy = model.elastic_force(u)
    for case in range(3):
        f, e = model.elastic_force(np.ascontiguousarray(u[:, case : case + 1]))
        np.testing.assert_allclose(force[:, case], f[:, 0], atol=1e-14 * np.abs(f).max())
        assert energy[case] == pytest.approx(e[0], rel=1e-13)


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_results_do_not_depend_on_the_thread_count() -> None:
    model = single(distorted(box((1.0, 0.8, 0.6), (3, 3, 2)), 0.03))
    u = np.column_stack([wave(model.points, s) for s in (0.2, -0.1)])
    results = []
    before = numba.get_num_threads()
    try:
        for count in (1, numba.config.NUMBA_NUM_THREADS):
            numba.set_num_threads(count)
            results.append((*model.elastic_force(u), model.elastic_tangent(u[:, 0]).data))
    finally:
        numba.set_num_threads(before)
    for one, many in zip(*results, strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_gives_total_mass_and_rigid_translation(element: str) -> None:
    model = _CASES[element]
    volume = model.nonlinear[0].weights.sum()
    for axis in "xyz":
        b = model.direction(axis)
        assert b @ model.mass @ b == pytest.approx(STEEL.density * volume, rel=1e-12)
    x, y = model.direction("x"), model.direction("y")
    assert abs(x @ model.mass @ y) < 1e-12 * STEEL.density * volume
    assert np.linalg.eigvalsh(model.mass.toarray()).min() > 0.0


def test_rotating_rod_has_the_inertia_of_a_box() -> None:
    """int rho (x^2 + z^2) dV about the y axis through the centre = m (a^2 + c^2)/12."""
    model = single(box((2.0, 0.4, 0.6), (2, 1, 1)))
    arm = model.points - np.array([1.0, 0.2, 0.3])
    v = np.cross([0.0, 1.0, 0.0], arm).ravel()
    mass = STEEL.density * 2.0 * 0.4 * 0.6
    assert v @ model.mass @ v == pytest.approx(mass * (2.0**2 + 0.6**2) / 12.0, rel=1e-13)


def test_linear_body_is_the_linearisation() -> None:
    mesh = distorted(box((1.0, 0.8, 0.6), (1, 1, 1)), 0.05)
    full = single(mesh)
    linear = replace(full.bodies[0], kinematics="linear")
    model = build_model([linear])
    u = wave(mesh.points, 0.1)
    expected = full.elastic_tangent(np.zeros(full.n_dof)) @ u
    force, energy = model.elastic_force(u[:, None])
    np.testing.assert_allclose(force[:, 0], expected, atol=1e-13 * np.abs(expected).max())
    assert energy[0] == pytest.approx(0.5 * u @ expected, rel=1e-13)


def test_materials_out_of_range_are_refused() -> None:
    for values in ((0.0, 0.3, 1.0), (1.0, 0.5, 1.0), (1.0, -1.0, 1.0), (1.0, 0.3, 0.0), (float("nan"), 0.3, 1.0)):
        with pytest.raises(FemInputError, match="material"):
            Material(*values)
    assert Material(2.5, 0.25, 1.0).lame_lambda == pytest.approx(1.0)
    assert Material(2.5, 0.25, 1.0).shear_modulus == pytest.approx(1.0)
