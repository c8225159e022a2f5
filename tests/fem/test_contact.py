"""Contact operators and interface forces between non-matching meshes."""

from __future__ import annotations

import numpy as np
import pytest

from fem.contact import ContactLaw, ContactState
from fem.errors import FemInputError
from fem.model import Body, Model, Pair, build_model
from tests.fem.small_models import STEEL, blocks, box, wave

MODEL = blocks(gap=0.01)


def _translate(model: Model, body: int, direction: np.ndarray) -> np.ndarray:
    u = np.zeros((len(model.points), 3))
    start = int(model.offsets[body])
    u[start : start + len(model.bodies[body].mesh.points)] = direction
    return u.ravel()


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_rigid_translation_of_the_slave_moves_gap_and_slip_by_its_components(element: str) -> None:
    """The frame of a point on y = 1 is (e_y, two tangents); a translation t gives (t . n, t . t1, t . t2)."""
    contact = blocks(element=element).contact
    model = blocks(element=element)
    t = np.array([0.3, 0.5, -0.2])
    moved = contact.relative(_translate(model, 1, t)[:, None]).reshape(-1, 3)
    np.testing.assert_allclose(moved[:, 0], 0.5, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), np.linalg.norm(t), rtol=1e-12)
    both = contact.relative((_translate(model, 0, t) + _translate(model, 1, t))[:, None])
    np.testing.assert_allclose(both, 0.0, atol=1e-13)


def test_every_slave_point_is_paired_and_sees_the_gap() -> None:
    """Each of the 2 x 2 slave facets lies on 2 x 2 of the 3 x 3 master facets: 16 pieces with 4 points."""
    contact = MODEL.contact
    assert contact.n_point == 16 * 4
    assert contact.area.sum() == pytest.approx(1.0, rel=1e-13)
    np.testing.assert_allclose(contact.initial_gap, 0.01, atol=1e-14)


def test_contact_forces_balance() -> None:
    """Sum of forces and moments of the interface about the origin vanish where slave and master points coincide."""
    model = blocks()
    u = _translate(model, 1, np.array([1e-4, -1e-3, 2e-4])) + wave(model.points, 1e-4)
    state = model.contact.evaluate(model.contact.relative(u[:, None]), model.contact.no_slip(1))
    assert set(np.unique(state.status)) >= {1}
    force = model.contact.force(state.traction).reshape(-1, 3)
    size = np.abs(force).sum()
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-13 * size)
    np.testing.assert_allclose(np.cross(model.points, force).sum(axis=0), 0.0, atol=1e-13 * size)


@pytest.mark.parametrize(("shear", "status"), [(1e-4, 1), (5e-2, 2)])
def test_tangent_equals_central_differences(shear: float, status: int) -> None:
    model = blocks()
    contact = model.contact
    u = _translate(model, 1, np.array([shear, -1e-2, 0.5 * shear]))
    slip = np.zeros((contact.n_point, 2))
    d = wave(model.points, 1.0) - _translate(model, 0, np.array([0.2, 0.1, 0.3]))

    def force(v: np.ndarray) -> np.ndarray:
        state = contact.evaluate(contact.relative(v[:, None]), slip[:, :, None])
        assert np.all(state.status == status)
        return contact.force(state.traction)[:, 0]

    h = 1e-7
    difference = (force(u + h * d) - force(u - h * d)) / (2.0 * h)
    # Truncation (h d / slip)^2 = 1e-11; roundoff 1e-16 F / (h k) = 1e-11.
    tangent = contact.tangent(u, slip)
    np.testing.assert_allclose(tangent @ d, difference, atol=1e-8 * np.abs(difference).max())
    stuck = contact.stick_tangent(np.full(contact.n_point, status))
    assert (abs(tangent - stuck).max() < 1e-12 * abs(stuck).max()) == (status == 1)


def test_cyclic_shear_dissipates_and_conserves() -> None:
    """Work done on the interface = stored + dissipated, to the first order of the backward difference in slip."""
    contact = blocks(friction=0.2).contact
    model = blocks(friction=0.2)
    press = _translate(model, 1, np.array([0.0, -1e-2, 0.0]))
    pull = _translate(model, 1, np.array([2e-2, 0.0, 1e-2]))
    slip, dissipated, work = contact.no_slip(1), 0.0, 0.0
    u = press[:, None]
    state = contact.evaluate(contact.relative(u), slip)
    stored = contact.stored_energy(state.traction)[0]
    n = 400
    for angle in np.linspace(0.0, 2.0 * np.pi, n + 1)[1:]:
        new_u = (press + np.sin(angle) * pull)[:, None]
        new = contact.evaluate(contact.relative(new_u), state.slip)
        increment = contact.dissipated(new.traction, state.slip, new.slip)[0]
        assert increment >= -1e-18
        mean = 0.5 * (contact.force(new.traction) + contact.force(state.traction))
        work += float((mean * (new_u - u)).sum())
        dissipated, state, u = dissipated + increment, new, new_u
    change = contact.stored_energy(state.traction)[0] - stored
    # Leading error: half a step of slip traction times the slips at both reversals, relative 1/n each.
    assert dissipated > 0.1 * work
    assert work == pytest.approx(change + dissipated, rel=4.0 / n)


def test_open_points_carry_and_store_nothing() -> None:
    contact = MODEL.contact
    state = contact.evaluate(contact.relative(np.zeros((MODEL.n_dof, 2))), contact.no_slip(2))
    assert isinstance(state, ContactState)
    assert not state.status.any()
    np.testing.assert_array_equal(contact.force(state.traction), 0.0)
    np.testing.assert_array_equal(contact.stored_energy(state.traction), 0.0)


def test_surfaces_that_do_not_face_each_other_are_refused() -> None:
    bodies = [
        Body("a", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL),
        Body("b", box((1.0, 1.0, 1.0), (1, 1, 1), shift=1.0), STEEL),
    ]
    with pytest.raises(FemInputError, match="contact joint"):
        build_model(bodies, pairs=[Pair("joint", "b.y_max", "a.y_max", 0.1)])
    with pytest.raises(FemInputError, match="contact joint"):
        build_model(bodies, pairs=[Pair("joint", "b.x_min", "a.y_max", 0.1)])


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.1), (1.0, -1.0, 0.1), (1.0, 1.0, -0.1), (1.0, 1.0, float("nan"))])
def test_laws_out_of_range_are_refused(values: tuple[float, float, float]) -> None:
    with pytest.raises(FemInputError, match="contact"):
        ContactLaw(*values)


def test_model_without_pairs_has_an_empty_contact() -> None:
    model = build_model([Body("a", box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL)])
    state = model.contact.evaluate(model.contact.relative(np.zeros((model.n_dof, 1))), model.contact.no_slip(1))
    assert model.contact.n_point == 0
    assert model.contact.force(state.traction).shape == (model.n_dof, 1)
    assert model.contact.tangent(np.zeros(model.n_dof), np.zeros((0, 2))).nnz == 0
