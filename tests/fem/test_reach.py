"""Which slave points are paired, which are left out, and what is said about those."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.block import graded, hex_block
from fem.contact_pair import WIDE
from fem.mesh import Mesh
from fem.preload import StaticState
from tests.fem.small_models import STEEL, blocks, box

HELD = fem.Support("lower.skin", ("x", "y", "z"))
RADIUS = 0.1


def _roller(cells: int, *, gap: float = 0.0) -> Mesh:
    """A slab of 0.1 x 0.02 x 0.01 m with a lower face of radius 0.1 m about z, ``gap`` m over y = 0."""

    def bend(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        sag = RADIUS - np.sqrt(RADIUS**2 - x * x)
        return np.column_stack([x, gap + y + (1.0 - y / 0.02) * sag, z])

    return hex_block(graded([-0.05, 0.05], [cells]), graded([0.0, 0.02], [2]), graded([0.0, 0.01], [1]), mapping=bend)


def _pressed(cells: int, down: float, reach: float | None = None) -> tuple[fem.Model, StaticState]:
    """The slab pressed by ``down`` m on a block that does not give."""
    base = hex_block(graded([-0.05, 0.05], [cells]), graded([-0.01, 0.0], [1]), graded([0.0, 0.01], [1]))
    model = fem.build_model(
        [fem.Body("upper", _roller(cells), STEEL, "linear"), fem.Body("lower", base, STEEL, "linear")],
        pairs=[fem.Pair("roll", "upper.y_min", "lower.y_max", 0.0, reach=reach)],
        supports=[HELD, fem.Support("upper.y_max", ("x", "y", "z"), (0.0, -down, 0.0))],
    )
    return model, fem.solve_static(model, model.load, fem.StaticSettings(steps=1, solver="superlu"))


@pytest.mark.parametrize("cells", [20, 50])
def test_refining_a_curved_contact_keeps_its_width(cells: int) -> None:
    """Points with gaps x^2 / 2R up to a twentieth of the diagonal are paired whatever the facets are: to one facet."""
    model = _pressed(cells, 1e-6)[0]
    diagonal = np.hypot(0.1, 0.01)
    assert model.contact.left_out.reach == pytest.approx([WIDE * diagonal], rel=1e-12)
    wide = np.sqrt(2.0 * RADIUS * WIDE * diagonal)
    assert np.abs(model.contact.points[:, 0]).max() == pytest.approx(wide, abs=0.1 / cells)


def test_points_that_come_through_out_of_reach_are_said() -> None:
    """A cut at a gap of 0.1 mm under a motion of 0.5 mm: the points between are behind the master by the rest."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", fem.ReachWarning)
        whole, state = _pressed(40, 5e-4)
    assert interface(whole, state).contact_area > 1.5 * 0.01 * 2.0 * np.sqrt(2.0 * RADIUS * 1e-4)
    with pytest.warns(fem.ReachWarning, match=r"contact roll: .* than the reach of 0\.0001 m .*missing") as seen:
        cut, state = _pressed(40, 5e-4, reach=1e-4)
    depth = cut.contact.left_out.depth(state.u[:, None])
    assert 0.0 < depth.max() < 4e-4
    assert "give the pair a reach of" in str(seen[0].message)


def interface(model: fem.Model, state: StaticState) -> fem.InterfaceState:
    return fem.interface_states(model, state.u, state.contact)[0]


def test_a_march_says_it_too() -> None:
    """A slab that flies at a base out of reach goes through it, and the history says so."""
    base = hex_block(graded([-0.05, 0.05], [4]), graded([-0.01, 0.0], [1]), graded([0.0, 0.01], [1]))
    model = fem.build_model(
        [fem.Body("upper", _roller(4, gap=1e-5), STEEL, "linear"), fem.Body("lower", base, STEEL, "linear")],
        pairs=[fem.Pair("roll", "upper.y_min", "lower.y_max", 0.0, stiffness=1e-3, reach=1e-3)],
        supports=[HELD],
    )
    rest = fem.rest_state(model)
    march = fem.Transient(
        model, rest, fem.no_modes(model, rest), fem.Rayleigh(0.0, 0.0), fem.TransientSettings(1e-5, solver="superlu")
    )
    velocity = np.zeros((model.n_dof, 1))
    velocity[1 : 3 * int(model.offsets[1]) : 3] = -200.0
    with pytest.warns(fem.ReachWarning, match="contact roll"):
        fem.record_history(march, march.start(0.0 * velocity, velocity), 3, np.zeros((1, model.n_dof)))


def test_flat_joints_leave_nothing_out() -> None:
    """A slave that hangs over, pressed and not: neither reach nor overhang is worth a word, and the share is said."""
    lower, upper = box((1.0, 1.0, 1.0), (2, 1, 2)), box((2.0, 1.0, 1.0), (5, 1, 3), shift=1.0)
    model = fem.build_model(
        [fem.Body("lower", lower, STEEL, "linear"), fem.Body("upper", upper, STEEL, "linear")],
        pairs=[fem.Pair("joint", "upper.y_min", "lower.y_max", 0.3)],
        supports=[HELD],
        loads=[fem.Pressure("press", "upper.y_max", 1e5)],
    )
    assert len(model.contact.left_out.gap) == 0
    half = replace(model, load=0.0 * model.load)
    state = fem.rest_state(half)
    assert interface(half, state).paired_share == pytest.approx(0.5, rel=1e-12)


def test_of_two_layers_the_nearer_one_is_the_partner() -> None:
    """A master with a second deck under the first: no area counts twice, and all gaps are those to the upper deck."""
    side = graded([0.0, 1.0], [3])
    decks = fem.merged([
        hex_block(side, graded([y, y + 0.01], [1]), side) for y in (-0.04, -0.01)
    ]).with_region("tops", lambda p: np.isin(p[:, 1].round(9), (-0.03, 0.0)))  # fmt: skip
    slab = hex_block(graded([-0.1, 1.1], [2]), graded([0.01, 0.1], [1]), graded([0.0, 1.0], [2]))
    model = fem.build_model(
        [fem.Body("lower", decks, STEEL), fem.Body("upper", slab, STEEL)],
        pairs=[fem.Pair("joint", "upper.y_min", "lower.tops", 0.3)],
    )
    assert model.contact.area.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(model.contact.initial_gap, 0.01, atol=1e-12)


def test_thin_parts_do_not_meet_through_themselves() -> None:
    """Two sheets paired by their whole skins: the top of one faces the bottom of the other, but not through both."""
    lower, upper = box((1.0, 0.01, 1.0), (3, 1, 3)), box((1.0, 0.01, 1.0), (2, 1, 2), shift=0.012)
    model = fem.build_model(
        [fem.Body("lower", lower, STEEL), fem.Body("upper", upper, STEEL)],
        pairs=[fem.Pair("joint", "upper.skin", "lower.skin", 0.3)],
    )
    np.testing.assert_allclose(model.contact.initial_gap, 0.002, atol=1e-12)
    assert model.contact.area.sum() == pytest.approx(1.0, rel=1e-12)
    assert len(model.contact.left_out.gap) == 0


def _interfering(depth: float, reach: float | None = None) -> fem.Model:
    """A block of facets 0.1 m that reaches into another by ``depth`` m on one half, and just touches on the other."""
    lower = hex_block(graded([0.0, 1.0], [10]), graded([-1.0, 0.0], [1]), graded([0.0, 0.1], [1]))

    def sink(points: np.ndarray) -> np.ndarray:
        low = (points[:, 1] == 0.0) & (points[:, 0] < 0.45)
        return points - np.outer(depth * low, [0.0, 1.0, 0.0])

    upper = hex_block(graded([0.0, 1.0], [10]), graded([0.0, 1.0], [1]), graded([0.0, 0.1], [1]), mapping=sink)
    return fem.build_model(
        [fem.Body("lower", lower, STEEL, "linear"), fem.Body("upper", upper, STEEL, "linear")],
        pairs=[fem.Pair("fit", "upper.y_min", "lower.y_max", 0.3, reach=reach)],
        supports=[HELD, fem.Support("upper.skin", ("x", "y", "z"))],
    )


def test_interference_deeper_than_half_a_facet_is_said() -> None:
    """It takes part with a reach given, and is watched without: never lost in silence."""
    given = _interfering(0.06, reach=0.1)
    assert given.contact.initial_gap.min() == pytest.approx(-0.06, abs=1e-12)
    model = _interfering(0.06)
    assert model.contact.initial_gap.min() > -0.05 - 1e-12
    with pytest.warns(fem.ReachWarning, match=r"contact fit: .* by 0\.06 m"):
        fem.solve_static(model, model.load, fem.StaticSettings(steps=1, solver="superlu"))


def test_surfaces_out_of_reach_are_told_how_far_they_are() -> None:
    lower, upper = box((1.0, 1.0, 1.0), (2, 1, 2)), box((1.0, 1.0, 1.0), (2, 1, 2), shift=1.3)
    bodies = [fem.Body("lower", lower, STEEL), fem.Body("upper", upper, STEEL)]
    with pytest.raises(fem.FemInputError, match=r"no slave point finds the master.*lies 0\.3 m before it: enlarge"):
        fem.build_model(bodies, pairs=[fem.Pair("joint", "upper.y_min", "lower.y_max", 0.3, reach=0.2)])


def test_first_touch_draws_the_nearest_points_only() -> None:
    """Half the facet of the nearest point counts, though outer ones are larger; a roller took 22 iterations, not 4."""
    model, state = _pressed(40, 1e-4)
    contact = model.contact
    graded_size = contact.facet_size * (1.0 + 1e3 * contact.points[:, 0] ** 2)
    near = replace(contact, facet_size=graded_size).nearest(np.zeros(3 * contact.n_point))
    first = contact.initial_gap.argmin()
    np.testing.assert_array_equal(near, contact.initial_gap <= contact.initial_gap[first] + 0.5 * graded_size[first])
    assert near.any()
    assert not near.all()
    assert len(state.residuals) <= 6
    flat = blocks(gap=0.01).contact
    assert flat.nearest(np.zeros(3 * flat.n_point)).all()


def _tied(shift: float, *, lift: float = 0.0) -> fem.Model:
    lower, upper = box((1.0, 1.0, 1.0), (4, 1, 2)), box((1.0, 1.0, 1.0), (5, 1, 2), shift=1.0)

    def moved(mesh: Mesh) -> Mesh:
        x, y, z = mesh.points.T
        points = np.column_stack([x + shift, y + lift * x * (y < 1.5), z])
        return Mesh(points, mesh.cells, mesh.element, mesh.surfaces)

    bodies = [fem.Body("lower", lower, STEEL, "linear"), fem.Body("upper", moved(upper), STEEL, "linear")]
    return fem.build_model(bodies, ties=[fem.Tie("bond", "upper.y_min", "lower.y_max")])


def test_ties_that_bond_little_are_named() -> None:
    """Thirty percent of two equal faces overlap; or a wedge lifts most of one face out of reach; a half lap passes."""
    with pytest.warns(fem.TieWarning, match=r"tie bond: only 30 % of the slave upper\.y_min .* the rest faces nothing"):
        model = _tied(0.7)
    assert model.bonds.area.sum() == pytest.approx(0.3, rel=1e-9)
    with pytest.warns(fem.TieWarning, match=r"% of the slave faces it farther than the reach of 0\.\d+ m: enlarge it"):
        _tied(0.0, lift=0.3)
    _tied(0.5)


def test_a_large_slave_on_a_small_master_is_whole() -> None:
    """What counts is the smaller surface."""
    lower, upper = box((0.3, 1.0, 1.0), (1, 1, 2)), box((1.0, 1.0, 1.0), (4, 1, 2), shift=1.0)
    bodies = [fem.Body("lower", lower, STEEL), fem.Body("upper", upper, STEEL)]
    model = fem.build_model(bodies, ties=[fem.Tie("bond", "upper.y_min", "lower.y_max")])
    assert model.bonds.area.sum() == pytest.approx(0.3, rel=1e-9)
