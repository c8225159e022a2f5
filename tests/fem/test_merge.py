"""Blocks that touch become one body."""

from __future__ import annotations

import numpy as np
import pytest

import fem
from fem.errors import FemInputError
from tests.fem.small_models import STEEL, box, wave


def _right_half(element: str) -> fem.Mesh:
    lines = [fem.graded([0.5, 1.0], [2]), fem.graded([0.0, 0.4], [2]), fem.graded([0.0, 0.3], [1])]
    return fem.hex_block(*lines, element=element)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_two_halves_are_the_whole(element: str) -> None:
    """The same nodes, cells, skin and internal force as one block."""
    whole = box((1.0, 0.4, 0.3), (4, 2, 1), element)
    joined = fem.merged([box((0.5, 0.4, 0.3), (2, 2, 1), element), _right_half(element)])
    assert (len(joined.points), len(joined.cells)) == (len(whole.points), len(whole.cells))
    assert len(joined.skin()) == len(whole.skin())
    assert {name: len(facets) for name, facets in joined.surfaces.items()} == {
        name: len(facets) for name, facets in whole.surfaces.items()
    }
    energies = []
    for mesh in (whole, joined):
        model = fem.build_model([fem.Body("body", mesh, STEEL)])
        energies.append(model.elastic_force(wave(model.points, 0.1)[:, None])[1][0])
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


def test_node_sets_are_united() -> None:
    left = box((0.5, 0.4, 0.3), (2, 2, 1)).with_region("line", fem.within(y=(0.0, 0.0), z=(0.0, 0.0)))
    right = _right_half("hex20").with_region("line", fem.within(y=(0.0, 0.0), z=(0.0, 0.0)))
    joined = fem.merged([left, right])
    assert joined.points[joined.nodes("line"), 0] == pytest.approx(np.linspace(0.0, 1.0, 9), abs=1e-12)


def test_meshes_that_cannot_be_merged_are_refused() -> None:
    with pytest.raises(FemInputError, match="hex20, tet10"):
        fem.merged([box((1.0, 1.0, 1.0), (1, 1, 1)), _right_half("tet10")])
    with pytest.raises(FemInputError, match="different elements"):
        fem.merged([])
    flat = box((1.0, 1e-9, 1.0), (1, 1, 1))
    with pytest.raises(FemInputError, match="nodes of one mesh coincide"):
        fem.merged([flat])


def test_reactions_balance_the_loads() -> None:
    mesh = box((1.0, 0.2, 0.1), (3, 1, 1))
    model = fem.build_model(
        [fem.Body("beam", mesh, STEEL)],
        supports=[fem.Support("beam.x_min", ("x", "y", "z")), fem.Support("beam.x_max&z_min", ("z",), 1e-4)],
        loads=[fem.Gravity("g", (0.0, 0.0, -9.81)), fem.Force("f", "beam.x_max", (50.0, 0.0, 0.0))],
    )
    state = fem.solve_static(model, model.load, fem.StaticSettings(1, 1e-10, 20, "superlu"))
    left, right = (fem.reaction(model, state, f"beam.{name}") for name in ("x_min", "x_max"))
    np.testing.assert_allclose(left + right, [-50.0, 0.0, 9.81 * 7800.0 * 0.02], atol=1e-5)
    assert right[2] > 0.0


def test_sides_of_one_name_are_united_only_where_they_are_one_side() -> None:
    """A step: the tops lie in two planes and do not touch, so neither is z_max; the front is one plane."""
    low = box((1.0, 0.4, 0.3), (2, 2, 1))
    high = fem.hex_block([0.5, 1.0], [0.0, 0.2, 0.4], [0.3, 0.7])
    step = fem.merged([low, high])
    assert {"z_max_1", "z_max_2", "x_min_1", "x_min_2"} <= set(step.surfaces)
    assert np.all(step.points[step.surface("z_max_2"), 2] == 0.7)
    assert np.ptp(step.points[step.surface("z_max_1"), 2]) == 0.0
    assert len(step.surface("x_max")) == len(step.surface("y_min")) + 1 == 4
    with pytest.raises(FemInputError, match=r"unknown surface; got z_max; known surfaces: .*z_max_1, z_max_2"):
        step.surface("z_max")
    # Two feet in one plane are one side though they do not touch; merged once more, names go on.
    feet = [fem.hex_block([x, x + 0.2], [0.0, 0.2], [-0.4, 0.0]) for x in (0.0, 0.8)]
    table = fem.merged([fem.hex_block([0.0, 0.2, 0.8, 1.0], [0.0, 0.2], [0.0, 0.1]), *feet])
    assert len(table.surface("z_min_2")) == 2
    again = fem.merged([step, fem.hex_block([1.0, 1.5], [0.0, 0.2, 0.4], [0.0, 0.3])])
    assert "z_max_2" in again.surfaces


def test_surfaces_of_one_name_that_the_user_gave_are_united() -> None:
    low = box((1.0, 0.4, 0.3), (2, 2, 1)).with_region("painted", fem.within(z=(0.3, 0.3), x=(0.0, 0.5)))
    high = fem.hex_block([0.5, 1.0], [0.0, 0.2, 0.4], [0.3, 0.7]).with_region("painted", fem.within(z=(0.7, 0.7)))
    assert len(fem.merged([low, high]).surface("painted")) == 4
