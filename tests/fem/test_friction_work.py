"""Work of friction of load steps: exact on straight paths, second order on others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.friction_work import friction_work
from tests.fem.small_models import STEEL, blocks, box

CONTACT = blocks(friction=0.3).contact
KN, KT, MU = CONTACT.law[0]
Path = Callable[[float], list[float]]


def _works(path: Path, steps: int) -> tuple[float, float]:
    """Work per area by the mean pressure and by that at the end of the steps, all points on path(t): gap, s1, s2."""

    def at(t: float) -> np.ndarray:
        return np.tile(path(t), CONTACT.n_point)[:, None]

    relative, mean, last = at(0.0), 0.0, 0.0
    state = CONTACT.evaluate(relative, CONTACT.no_slip(1))
    for t in np.linspace(0.0, 1.0, steps + 1)[1:]:
        after = at(t)
        new = CONTACT.evaluate(after, state.slip)
        work = friction_work(CONTACT, (relative, after), (state, new))
        mean += float(work.mean())
        last += float(CONTACT.dissipated(new.traction, state.slip, new.slip)[0] / CONTACT.area.sum())
        relative, state = after, new
    return mean, last


# mu kn (= kt here) of depth per slip: what slides before the limit is elastic.
STRAIGHT: list[tuple[Path, float]] = [
    # Slides from the start, p = kn 1e-3 t, slip (5 - 0.3) 1e-3 t: mu kn 1e-3 4.7e-3 / 2.
    (lambda t: [-1e-3 * t, 5e-3 * t, 0.0], 0.5 * MU * KN * 1e-3 * 4.7e-3),
    # Along a diagonal of the tangents: the same.
    (lambda t: [-1e-3 * t, 3e-3 * t, 4e-3 * t], 0.5 * MU * KN * 1e-3 * 4.7e-3),
    # Stuck until 3e-3 t = 0.3e-3 (1 + t), t = 1/9, then pressure (1 + t), slip rate 2.7e-3: mean (10/9 + 2)/2.
    (lambda t: [-1e-3 * (1.0 + t), 3e-3 * t, 0.0], MU * KN * 1e-3 * 14.0 / 9.0 * 2.7e-3 * 8.0 / 9.0),
    # Opens at t = 1/2: onset at 3 t = 0.3 (1 - 2 t), t = 1/12; to there the spring lets go, slip 3e-3 / 2 in all.
    (lambda t: [-1e-3 * (1.0 - 2.0 * t), 3e-3 * t, 0.0], 0.5 * MU * KN * 1e-3 * (10.0 / 12.0) * 1.5e-3),
    # Closes at t = 1/2, slides from there: pressure to 1e-3 kn, slip (3/2 - 0.3) 1e-3.
    (lambda t: [-1e-3 * (2.0 * t - 1.0), 3e-3 * t, 0.0], 0.5 * MU * KN * 1e-3 * 1.2e-3),
    # Comes down and sticks: nothing, though it moved in the air; never down; stuck; held without friction work.
    (lambda t: [-1e-3 * (2.0 * t - 1.0), 2e-4 * t, 0.0], 0.0),
    (lambda t: [1e-3, 3e-3 * t, 0.0], 0.0),
    (lambda t: [-1e-3, 2e-4 * t, 0.0], 0.0),
]


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize(("path", "exact"), STRAIGHT)
def test_straight_paths_are_exact(path: Path, exact: float, steps: int) -> None:
    """Gap and slip linear in time: one step and four give the integral of tau ds but for rounding, 1e-12."""
    assert _works(path, steps)[0] == pytest.approx(exact, rel=1e-11, abs=1e-12)


def test_curved_paths_are_of_second_order() -> None:
    """Pressure kn 1e-3 (0.2 + t^3), sliding along one direction: halving the step quarters the error, the other halves.

    Between 16, 32 and 64 steps the rate is 2 and 1 to 0.1; the exact work is the integral of mu p (ds - mu dp / kt).
    """

    def path(t: float) -> list[float]:
        return [-1e-3 * (0.2 + t**3), 1e-3 * (t + 3.0 * t * t), 0.0]

    t = np.linspace(0.0, 1.0, 200_001)
    depth, slide = 1e-3 * (0.2 + t**3), 1e-3 * (t + 3.0 * t * t)
    onset = int(np.argmax(slide >= MU * depth))
    slip = slide - MU * depth * KN / KT
    pressure = MU * KN * depth
    exact = float((0.5 * (pressure[onset + 1 :] + pressure[onset:-1]) * np.diff(slip[onset:])).sum())
    errors = np.array([[abs(work - exact) for work in _works(path, n)] for n in (16, 32, 64)])
    rates = np.log2(errors[:-1] / errors[1:])
    assert rates[:, 0] == pytest.approx([2.0, 2.0], abs=0.1)
    assert rates[:, 1] == pytest.approx([1.0, 1.0], abs=0.1)
    assert errors[0, 0] < 0.01 * exact


@pytest.mark.parametrize("steps", [1, 4])
def test_a_cube_slid_under_a_growing_pressure(steps: int) -> None:
    """Pressed by 1e4 t Pa and moved by d t: work mu p (d - mu p / k_t) / 2 per area; it was 25 % more at four steps."""
    lower, upper = box((1.0, 1.0, 1.0), (2, 1, 2)), box((1.0, 1.0, 1.0), (2, 1, 2), shift=1.0)
    bodies = [fem.Body("lower", lower, STEEL, "linear"), fem.Body("upper", upper, STEEL, "linear")]
    model = fem.build_model(
        bodies,
        pairs=[fem.Pair("joint", "upper.y_min", "lower.y_max", MU)],
        supports=[fem.Support("lower.skin", ("x", "y", "z")), fem.Support("upper.skin", ("z",))],
        loads=[fem.Pressure("press", "upper.y_max", 1e4)],
    )
    distance = 1e-3
    moved = replace(model, prescribed=0.0 * model.prescribed, free=model.free.copy())
    skin = 3 * np.unique(model.facets("upper.skin"))
    moved.free[skin] = False
    moved.prescribed[skin] = distance
    state = fem.solve_static(moved, moved.load, fem.StaticSettings(steps=steps, solver="superlu"))
    # Uniform to the Poisson bulging that the free sides of the cube allow.
    joint = fem.interface_states(moved, state.u, state.contact, dissipated=state.dissipated)[0]
    area = moved.contact.area
    exact = 0.5 * MU * 1e4 * (distance - MU * 1e4 / moved.contact.law[0, 1])
    assert float(joint.dissipated @ area) == pytest.approx(exact, rel=1e-4)
