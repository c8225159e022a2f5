"""Rigid motions and the check that something holds every body."""

from __future__ import annotations

import numpy as np
import pytest

from fem.errors import FemInputError
from fem.model import Support, build_model
from fem.rigid_motion import check_restraint, rigid_motions
from tests.fem.small_models import blocks, box, clamped_strip, distorted, single


def test_rigid_motions_cost_no_elastic_force() -> None:
    model = single(distorted(box((1.0, 0.8, 0.6), (2, 1, 1)), 0.05))
    K = model.elastic_tangent(np.zeros(model.n_dof))
    motions = rigid_motions(model)
    assert motions.shape == (model.n_dof, 6)
    assert np.linalg.matrix_rank(motions) == 6
    assert np.abs(K @ motions).max() < 1e-12 * abs(K).max()


def test_supported_and_clamped_structures_pass() -> None:
    check_restraint(clamped_strip())
    check_restraint(single(box((1.0, 1.0, 1.0), (1, 1, 1)), supports=(Support("body.x_min", ("x", "y", "z")),)))


@pytest.mark.parametrize(
    ("supports", "motion"),
    [
        ((Support("body.x_min", ("x",)), Support("body.y_min", ("y",))), "translate along z"),
        ((Support("body.x_min", ("y", "z")),), "translate along x"),
    ],
)
def test_missing_support_is_named(supports: tuple[Support, ...], motion: str) -> None:
    with pytest.raises(FemInputError, match=f"body: .*{motion}"):
        check_restraint(single(box((1.0, 1.0, 1.0), (1, 1, 1)), supports=supports))


def test_frictionless_joint_lets_the_upper_block_slide() -> None:
    held = (Support("lower.y_min", ("x", "y", "z")),)
    rough, smooth = blocks(friction=0.3), blocks(friction=0.0)
    check_restraint(build_model(rough.bodies, pairs=rough.pairs, supports=held))
    with pytest.raises(FemInputError, match=r"^upper: "):
        check_restraint(build_model(smooth.bodies, pairs=smooth.pairs, supports=held))
