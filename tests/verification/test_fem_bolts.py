"""Bolts: V12 joint diagram, torque formula, curved cuts, loads that a bolt must survive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fem.block import graded, hex_block
from fem.bolt import Bolt
from fem.equilibrium import interface_states
from fem.errors import FemConvergenceError, FemInputError
from fem.loads import Force
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Model, Pair, Support, Tie, build_model
from fem.modes import rest_state
from fem.newton import LoadStep, Target, Tolerance
from fem.preload import StaticSettings, StaticState, lock_bolts, solve_preload, solve_static
from fem.tightening import bolt_force

E, LENGTH, WIDTH, F0 = 200e9, 0.04, 0.01, 9.1e3
SOFT = Material(E, 0.0, 7800.0)
RIGID = Material(1e6 * E, 0.0, 7800.0)
"""Ends a million times stiffer than the stack: they bend by 1e-6 of what the bolt stretches."""

SETTINGS = StaticSettings(steps=2, solver="superlu")


def _block(x: tuple[float, float], y: tuple[float, float], cells: tuple[int, int], element: str = "hex20") -> Mesh:
    lines = [graded(list(interval), [n]) for interval, n in ((x, cells[0]), (y, cells[1]), ((0.0, WIDTH), 1))]
    return hex_block(*lines, element=element)


def _joint(pull: float = 0.0, *, shank: Mesh | None = None, section: float = 0.021) -> Model:
    """A shank of area A and a sleeve of 3 A between a rigid base and a rigid head that ``pull`` N lifts."""
    shank = shank or _block((0.0, WIDTH), (0.0, LENGTH), (1, 4))
    bodies = [
        Body("base", _block((0.0, WIDTH), (-0.01, 0.0), (1, 1)), RIGID, "linear"),
        Body("shank", shank, SOFT, "linear"),
        Body("sleeve", _block((WIDTH, 4 * WIDTH), (0.0, LENGTH), (3, 3)), SOFT, "linear"),
        Body("head", _block((0.0, 4 * WIDTH), (LENGTH, LENGTH + 0.01), (1, 1)), RIGID, "linear"),
    ]
    return build_model(
        bodies,
        pairs=[Pair("under_head", "sleeve.y_max", "head.y_min", 0.2, stiffness=1e3)],
        ties=[
            Tie("thread", "shank.y_min", "base.y_max", stiffness=1e3),
            Tie("neck", "shank.y_max", "head.y_min", stiffness=1e3),
        ],
        bolts=[Bolt("bolt", "shank", F0, section=section)],
        supports=[
            Support("base.skin", ("x", "y", "z")),
            Support("sleeve.y_min", ("y",)),
            *[Support(f"{body}.skin", ("x", "z")) for body in ("shank", "sleeve", "head")],
        ],
        loads=[Force("pull", "head.y_max", (0.0, pull, 0.0))],
    )


@dataclass(frozen=True)
class Tightened:
    """The joint with its bolt locked at F0, no load."""

    model: Model
    state: StaticState

    def under(self, pull: float) -> tuple[float, float]:
        """Bolt force and interface force in N under a pull."""
        load = self.model.load + _joint(pull).load
        settings = StaticSettings(steps=1, solver="superlu")
        state = solve_static(self.model, load, settings, start=self.state)
        interface = interface_states(self.model, state.u, state.contact)[0]
        return float(self.model.bolts.forces(state.u)[0]), interface.normal_force


@pytest.fixture(scope="module")
def tightened() -> Tightened:
    return Tightened(*solve_preload(_joint(), SETTINGS))


def _bolt_share() -> float:
    """C = k_b / (k_b + k_m) with the penalties: two ties and the section lengthen the bolt, one contact the sleeve."""
    bolt = 1.0 / (LENGTH + 3e-3 * WIDTH)
    sleeve = 3.0 / (LENGTH + 1e-3 * WIDTH)
    return bolt / (bolt + sleeve)


def test_v12_tightening_reaches_the_force(tightened: Tightened) -> None:
    """V12: at zero load bolt and interface carry F0 = 9.1 kN; 1e-6 (manual). The bolt shortens by F0/k_b + F0/k_m."""
    force, interface = tightened.under(0.0)
    assert force == pytest.approx(F0, rel=1e-6)
    assert interface == pytest.approx(F0, rel=1e-6)
    lengths = LENGTH + 3e-3 * WIDTH + (LENGTH + 1e-3 * WIDTH) / 3.0
    assert tightened.model.bolts.shortening[0] == pytest.approx(F0 * lengths / (E * WIDTH**2), rel=1e-6)


@pytest.mark.parametrize("pull", [2e3, 6e3, 10e3, 12.1e3])
def test_v12_bolt_takes_its_share_of_the_load(tightened: Tightened, pull: float) -> None:
    """V12: bolt force F0 + C P, interface F0 - (1 - C) P; C = 1/4 to F/k_p (2.5e-3 of C), exact with the penalties."""
    force, interface = tightened.under(pull)
    share = _bolt_share()
    assert share == pytest.approx(0.25, rel=2.5e-3)
    # 1e-6 of the manual and the ends, which bend by 1e-6.
    assert force == pytest.approx(F0 + share * pull, rel=1e-6)
    assert interface == pytest.approx(F0 - (1.0 - share) * pull, abs=1e-6 * F0)


def test_v12_joint_opens_where_it_should_and_the_bolt_then_carries_all(tightened: Tightened) -> None:
    """V12: separation at P = F0/(1 - C) = 12.133 kN (to F/k_p: 1e-3), above it bolt force = P; 1e-6 (manual)."""
    opening = F0 / (1.0 - _bolt_share())
    assert opening == pytest.approx(12.133e3, rel=1e-3)
    assert tightened.under(opening * (1.0 - 1e-4))[1] > 0.0
    for pull in (opening * (1.0 + 1e-4), 15e3):
        force, interface = tightened.under(pull)
        assert interface == 0.0
        assert force == pytest.approx(pull, rel=1e-6)


def test_a_cut_along_the_faces_of_tetrahedra_tightens_as_well() -> None:
    """The section of a tetrahedral shank is no plane; the force along the axis is the same."""
    model = _joint(shank=_block((0.0, WIDTH), (0.0, LENGTH), (1, 4), "tet10"), section=0.0251)
    section = model.facets("shank.section_head")
    assert np.ptp(model.points[section][:, :, 1]) > 1e-3
    locked, state = solve_preload(model, SETTINGS)
    assert locked.bolts.forces(state.u)[0] == pytest.approx(F0, rel=1e-6)
    assert interface_states(locked, state.u, state.contact)[0].normal_force == pytest.approx(F0, rel=1e-6)


def test_locking_again_restores_the_equilibrium(tightened: Tightened) -> None:
    """A model built anew and locked at the recorded shortening is in balance with the recorded state."""
    again = lock_bolts(_joint(), tightened.model.bolts.shortening)
    state = solve_static(again, again.load, SETTINGS, start=tightened.state)
    # Both steps start within the tolerance: nothing is left to iterate.
    assert len(state.residuals) == 2


def test_torque_formula_gives_what_its_printed_numbers_give() -> None:
    """T = 10.1 N m, P = 1 mm, d2 = 6 mm, D_f = 8 mm, both friction coefficients 0.2: 6111.6 N, not 9.1 kN."""
    assert bolt_force(10.1, 1e-3, (6e-3, 8e-3), (0.2, 0.2)) == pytest.approx(6111.6, abs=0.05)


def test_torque_formula_refuses_nonsense() -> None:
    with pytest.raises(FemInputError, match="torque"):
        bolt_force(-1.0, 1e-3, (6e-3, 8e-3), (0.2, 0.2))


@pytest.mark.parametrize(
    ("bolt", "message"),
    [
        (Bolt("b", "nut", F0), "unknown body"),
        (Bolt("b", "shank", F0, section=1.0), "misses the shank"),
    ],
)
def test_bolts_that_cannot_be_built_say_why(bolt: Bolt, message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        build_model([Body("shank", _block((0.0, WIDTH), (0.0, LENGTH), (1, 4)), SOFT)], bolts=[bolt])


@pytest.mark.parametrize(("force", "axis"), [(-1.0, "y"), (float("nan"), "y"), (1.0, "r")])
def test_bolts_out_of_range_are_refused(force: float, axis: str) -> None:
    with pytest.raises(FemInputError, match="bolt b"):
        Bolt("b", "shank", force, axis)


def test_bolt_that_nothing_presses_back_is_refused() -> None:
    """A bar held at one end: shortening it builds up no force."""
    lines = np.linspace(0.0, 1.0, 5), np.array([0.0, 0.2]), np.array([0.0, 0.2])
    bar = Body("bar", hex_block(*lines), SOFT)
    model = build_model(
        [bar], bolts=[Bolt("x", "bar", 1e3, axis="x")], supports=[Support("bar.x_min", ("x", "y", "z"))]
    )
    with pytest.raises(FemInputError, match="bolt x: nothing holds against tightening"):
        solve_preload(model, StaticSettings())


def _turned(direction: int) -> tuple[Model, np.ndarray]:
    """A shank that presses two sleeves, turned by 40 and 25 degrees about two axes unless ``direction`` is 0."""
    first, second = np.deg2rad([40.0, 25.0]) * abs(direction)
    about_z = np.array([[np.cos(first), -np.sin(first), 0.0], [np.sin(first), np.cos(first), 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(second), -np.sin(second)], [0.0, np.sin(second), np.cos(second)]])
    turn = about_x @ about_z

    def placed(name: str, x: tuple[float, float], y: tuple[float, float], cells: tuple[int, int]) -> Body:
        mesh = _block(x, y, cells)
        return Body(name, Mesh(mesh.points @ turn.T, mesh.cells, mesh.element, mesh.surfaces), SOFT, "linear")

    bodies = [
        placed("base", (0.0, 3 * WIDTH), (-0.01, 0.0), (3, 1)),
        placed("shank", (WIDTH, 2 * WIDTH), (0.0, LENGTH), (1, 4)),
        placed("left", (0.0, WIDTH), (0.0, LENGTH), (1, 3)),
        placed("right", (2 * WIDTH, 3 * WIDTH), (0.0, LENGTH), (1, 3)),
        placed("head", (0.0, 3 * WIDTH), (LENGTH, LENGTH + 0.01), (3, 1)),
    ]
    seams = [("y_max", "head.y_min"), ("y_min", "base.y_max")]
    model = build_model(
        bodies,
        pairs=[Pair(f"{n}_{s}", f"{n}.{s}", m, 0.2) for n in ("left", "right") for s, m in seams],
        ties=[Tie("thread", "shank.y_min", "base.y_max"), Tie("neck", "shank.y_max", "head.y_min")],
        bolts=[Bolt("bolt", "shank", F0, "y" if direction == 0 else tuple(3.0 * direction * turn[:, 1]))],
        supports=[Support("base.y_min", ("x", "y", "z"))],
    )
    return model, turn


def test_contact_that_opens_on_the_way_asks_for_a_smaller_step() -> None:
    """An iterate whose contact is partly open was taken for a bolt that nothing holds, and the solution given up."""
    model, _ = _turned(1)
    target = Target(model.load, 0.0 * model.load, model.bolts.wanted, touching=False)
    contact = rest_state(model).contact
    step = LoadStep(model, target, contact.slip, Tolerance(1e-8, F0, 30, "superlu"))
    partly = np.where(np.arange(model.contact.n_point)[:, None] % 2 == 0, 0, 1)
    with pytest.raises(FemConvergenceError, match="contact that a bolt presses opens on the way"):
        step._check_tightened(np.zeros((1, 1)), replace(contact, status=partly))
    with pytest.raises(FemInputError, match="nothing holds against tightening"):
        step._check_tightened(np.zeros((1, 1)), replace(contact, status=np.ones_like(partly)))


@pytest.mark.parametrize("direction", [1, -1])
def test_oblique_bolts_are_those_along_y_turned(direction: int) -> None:
    """The turned displacement, shortening and forces, to the tolerance of 1e-10; the axis may point either way."""
    settings = StaticSettings(steps=2, tolerance=1e-10, solver="superlu")
    straight, _ = _turned(0)
    locked, state = solve_preload(straight, settings)
    oblique, turn = _turned(direction)
    tight, turned = solve_preload(oblique, settings)
    moved = turned.u.reshape(-1, 3) @ turn
    # Nodes of the cut change sides with the axis: the parts around the shank are compared.
    around = np.delete(np.arange(len(moved)), np.arange(oblique.offsets[1], oblique.offsets[2]))
    np.testing.assert_allclose(moved[around], state.u.reshape(-1, 3)[around], atol=1e-8 * np.abs(state.u).max())
    assert tight.bolts.forces(turned.u)[0] == pytest.approx(F0, rel=1e-9)
    assert tight.bolts.shortening[0] == pytest.approx(locked.bolts.shortening[0], rel=1e-8)
    here, there = (interface_states(m, s.u, s.contact)[0] for m, s in ((locked, state), (tight, turned)))
    assert there.normal_force == pytest.approx(here.normal_force, rel=1e-8)


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        ((0.0, 0.0, 0.0), "bolt b: the axis has no direction"),
        ((1.0, 0.0), "bolt b: the axis has the wrong shape"),
        ((1.0, np.nan, 0.0), "bolt b: the axis is not finite"),
        ("w", r"unknown axis; got w; choose x, y, z or a direction"),
    ],
)
def test_axes_that_point_nowhere_are_refused(axis: object, message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        Bolt("b", "shank", F0, axis)
