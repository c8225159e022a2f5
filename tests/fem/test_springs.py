"""Springs, foundations and point masses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.errors import FemInputError
from fem.inp_writer import write_inp
from fem.loads import Force, Gravity
from fem.model import Body, Foundation, Model, PointMass, Spring, Support, build_model
from fem.modes import Rayleigh, rest_state, solve_modes
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import STEEL, box

CENTRE = (0.05, 0.05, 0.05)
MASS = STEEL.density * 1e-3


def _cube(**joints: object) -> Model:
    """A cube of 100 mm that slides along x only."""
    sides = [Support(f"cube.{face}", (axis,)) for axis in "yz" for face in (f"{axis}_min", f"{axis}_max")]
    body = Body("cube", box((0.1, 0.1, 0.1), (1, 1, 1)), STEEL, "linear")
    return build_model([body], supports=sides, **joints)  # type: ignore[arg-type]


def test_mass_on_a_spring_has_its_frequency() -> None:
    """omega^2 = k / (m + m_point): the cube is 1e5 times stiffer than the spring."""
    model = _cube(springs=[Spring("soft", CENTRE, (1e4, 0.0, 0.0))], point_masses=[PointMass("added", CENTRE, 3.0)])
    modes = solve_modes(model, rest_state(model), 1)
    assert modes.omega[0] ** 2 == pytest.approx(1e4 / (MASS + 3.0), rel=1e-4)


@pytest.mark.parametrize("springs", [
    [Spring("rod", CENTRE, (2e6, 0.0, 0.0))],
    [Foundation("bed", "cube.x_min", normal=2e8)],
    [Foundation("side", "cube.y_min", normal=0.0, tangential=2e8)],
], ids=["spring", "normal bed", "shear bed"])  # fmt: skip
def test_springs_carry_the_load(springs: list[Spring | Foundation]) -> None:
    """All of 2e6 N/m; 1 N on the whole face moves the face by 1/k plus the strain of the cube; the reaction is -1 N."""
    model = _cube(springs=springs, loads=[Force("pull", "cube.x_max", (1.0, 0.0, 0.0))])
    state = solve_static(model, model.load, StaticSettings(steps=1))
    assert model.springs.forces(state.u)[springs[0].name] == pytest.approx([-1.0, 0.0, 0.0], abs=1e-9)
    mean = float(model.load @ state.u)
    assert mean == pytest.approx(1.0 / 2e6, rel=1e-3)


def test_spring_between_two_points_pulls_both() -> None:
    """Two cubes, one held: the other hangs on the spring and moves by F/k more than the first end."""
    held = Body("held", box((0.1, 0.1, 0.1), (1, 1, 1)), STEEL, "linear")
    free = Body("free", box((0.1, 0.1, 0.1), (1, 1, 1), shift=0.3), STEEL, "linear")
    model = build_model(
        [held, free],
        supports=[Support("held.y_min", ("x", "y", "z"))],
        springs=[
            Spring("hanger", (0.05, 0.35, 0.05), (0.0, 1e5, 0.0), to=(0.05, 0.1, 0.05)),
            Foundation("guide", "free.x_min", tangential=1.0),
            Foundation("rest", "free.z_min"),
        ],
        loads=[Gravity("weight", (0.0, -10.0, 0.0), ("free",))],
    )
    state = solve_static(model, model.load, StaticSettings(steps=1))
    pull = model.springs.forces(state.u)["hanger"]
    assert pull[1] == pytest.approx(10.0 * MASS, rel=1e-4)


def test_a_stiff_bed_holds_a_part_and_a_soft_direction_does_not() -> None:
    """A body that slides on its bed is named."""
    body = Body("cube", box((0.1, 0.1, 0.1), (1, 1, 1)), STEEL, "linear")
    model = build_model([body], springs=[Foundation("bed", "cube.y_min")])
    with pytest.raises(FemInputError, match="cube"):
        solve_static(model, model.load, StaticSettings(steps=1))
    held = build_model([body], springs=[Foundation("bed", "cube.y_min", tangential=1e9)])
    assert np.array_equal(solve_static(held, held.load, StaticSettings(steps=1)).u, np.zeros(held.n_dof))


def test_lumped_mass_holds_the_point_masses() -> None:
    """Positive everywhere, the sum is that of the structure; the explicit scheme takes it."""
    model = _cube(springs=[Spring("rod", CENTRE, (2e6, 0.0, 0.0))], point_masses=[PointMass("added", CENTRE, 3.0)])
    lumped = model.lumped_mass()
    assert (lumped > 0.0).all()
    assert lumped[::3].sum() == pytest.approx(MASS + 3.0)
    assert model.mass[::3][:, ::3].sum() == pytest.approx(MASS + 3.0)
    march = ExplicitTransient(model, rest_state(model), Rayleigh(0.0, 0.0), ExplicitSettings(1e-5))
    velocity = model.direction("x")[:, None] * model.free[:, None]
    record = list(march.march(march.start(0.0 * velocity, velocity), 3))[-1]
    assert record.energies.sum() == pytest.approx(0.5 * (MASS + 3.0), rel=1e-3)


def test_bad_springs_and_masses_are_refused(tmp_path: Path) -> None:
    """Each message names the spring or mass."""
    with pytest.raises(FemInputError, match="spring rod: stiffness must not be negative"):
        _cube(springs=[Spring("rod", CENTRE, (-1.0, 0.0, 0.0))])
    with pytest.raises(FemInputError, match="spring rod"):
        _cube(springs=[Spring("rod", (9.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    with pytest.raises(FemInputError, match="point mass added: mass must be positive"):
        _cube(point_masses=[PointMass("added", CENTRE, 0.0)])
    with pytest.raises(FemInputError, match="springs and point masses are not written"):
        write_inp(tmp_path / "m.inp", _cube(springs=[Spring("rod", CENTRE, (1.0, 0.0, 0.0))]))
