"""Models: names, supports, loads, refused input."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.model import Body, Clamp, Pair, Support, build_model, default_penalty
from tests.fem.small_models import STEEL, box

BODY = Body("beam", box((0.3, 0.2, 0.1), (2, 1, 1)), STEEL)


def test_clamp_is_a_uniform_pressure_with_its_resultant() -> None:
    model = build_model([BODY], clamps=[Clamp("press", "beam.y_max", 500.0), Clamp("pull", "beam.x_max", -30.0)])
    np.testing.assert_allclose(model.load.reshape(-1, 3).sum(axis=0), [30.0, -500.0, 0.0], atol=1e-11)
    moment = np.cross(model.points, model.load.reshape(-1, 3)).sum(axis=0)
    # Centres of pressure (0.15, 0.2, 0.05) and (0.3, 0.1, 0.05).
    expected = np.cross([0.15, 0.2, 0.05], [0.0, -500.0, 0.0]) + np.cross([0.3, 0.1, 0.05], [30.0, 0.0, 0.0])
    np.testing.assert_allclose(moment, expected, atol=1e-11)
    assert model.loads.shape == (2, model.n_dof)


def test_supports_fix_the_named_directions_only() -> None:
    model = build_model([BODY], supports=[Support("beam.x_min", ("x", "z"))])
    held = ~model.free.reshape(-1, 3)
    at_end = model.points[:, 0] == 0.0
    np.testing.assert_array_equal(held[:, 0], at_end)
    np.testing.assert_array_equal(held[:, 1], False)
    np.testing.assert_array_equal(held[:, 2], at_end)
    constrained = model.constrain(model.elastic_tangent(np.zeros(model.n_dof)))
    fixed = np.flatnonzero(~model.free)
    np.testing.assert_array_equal(constrained[fixed].toarray(), np.eye(model.n_dof)[fixed])
    assert abs(constrained - constrained.T).max() < 1e-14 * abs(constrained).max()


def test_default_penalty_is_modulus_over_facet_size() -> None:
    facets = BODY.mesh.surface("y_max")
    assert default_penalty(BODY, facets) == pytest.approx(200e9 / np.sqrt(0.15 * 0.1), rel=1e-12)


def test_unknown_names_are_refused_with_the_known_ones() -> None:
    for surface in ("plate.x_min", "beam"):
        with pytest.raises(FemInputError, match="bodies beam"):
            build_model([BODY], supports=[Support(surface, ("x",))])
    with pytest.raises(FemInputError, match="known surfaces"):
        build_model([BODY], clamps=[Clamp("press", "beam.top", 1.0)])
    with pytest.raises(FemInputError, match="unknown direction"):
        build_model([BODY], supports=[Support("beam.x_min", ("w",))])
    with pytest.raises(FemInputError, match="unknown kinematics"):
        build_model([Body("beam", BODY.mesh, STEEL, "corotated")])
    with pytest.raises(FemInputError, match="bodies beam"):
        build_model([BODY], pairs=[Pair("joint", "beam.x_min", "plate.x_max", 0.1)])


def test_two_bodies_of_one_name_are_refused() -> None:
    with pytest.raises(FemInputError, match="beam"):
        build_model([BODY, BODY])
