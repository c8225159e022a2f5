"""Transients against closed forms: V20 one-sided spring, V21 bar impact by both schemes, NAFEMS 5T step response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from fem.block import graded, hex_block
from fem.body import Body
from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.contact import Contact
from fem.excitation import time_load
from fem.loads import Gravity
from fem.material import Material
from fem.model import Model, Pair, build_model
from fem.modes import Rayleigh, no_modes, rest_state, solve_modes
from fem.motion import StepRecord
from fem.preload import StaticSettings, solve_static
from fem.reach import joined_left_out
from fem.supports import Support
from fem.transient import Transient, TransientSettings

NO_DAMPING = Rayleigh(0.0, 0.0)


def _one_sided_spring() -> Model:
    """A unit mass on k = 1 along x that meets another spring of 3 where u < 0: 4 in all."""
    unit = sp.csr_matrix(np.eye(3))
    operator = sp.csr_matrix(np.eye(3))
    law = np.array([[3.0, 1.0, 0.0]])
    one, zero = np.ones(1), np.zeros((1, 3))
    number, both, nothing = np.zeros(1, dtype=np.int64), np.ones((1, 2)), joined_left_out((), 3)
    contact = Contact(operator, one, 0.0 * one, law, zero, ("stop",), number, one, one, np.eye(3)[None], both, nothing)
    free, none = np.array([True, False, False]), np.zeros(3)
    side = graded([0.0, 1.0], [1])
    cube = build_model([Body("cube", hex_block(side, side, side), Material(1.0, 0.0, 1.0), "linear")])
    matrices = {"stiffness": unit, "mass": unit, "contact": contact, "points": zero}
    return replace(cube, bodies=(), **matrices, free=free, load=none, loads=zero[:0], prescribed=none)


@pytest.mark.parametrize("amplitude", [1e-3, 1.0])
def test_v20_one_sided_spring_has_the_frequency_four_thirds(amplitude: float) -> None:
    """V20: omega = 2 w1 w2/(w1 + w2) = 4/3 at any amplitude; 1e-4 (manual), from the time of ten periods.

    omega h = 8e-3 in the stiffer half: average acceleration errs by (omega h)^2/12 = 5e-6.
    """
    model, h = _one_sided_spring(), 4e-3
    rest = rest_state(model)
    settings = TransientSettings(h, 1.0, tolerance=1e-12, dispersion_correction=False, solver="superlu")
    transient = Transient(model, rest, no_modes(model, rest), NO_DAMPING, settings, force_scale=amplitude)
    start = np.array([[amplitude], [0.0], [0.0]])
    n = round(10.5 * 1.5 * np.pi / h)
    records = list(transient.march(transient.start(start, 0.0 * start), n))
    u = np.array([r.state.u[0, 0] for r in records])
    # Upward passages of zero, by the chord: the first is at 3/4 of the second half, then one per period.
    at = np.flatnonzero((u[:-1] < 0.0) & (u[1:] >= 0.0))
    times = h * (at + 1 - u[at] / (u[at + 1] - u[at]))
    assert len(times) == 10
    assert 2.0 * np.pi * 9.0 / (times[-1] - times[0]) == pytest.approx(4.0 / 3.0, abs=1e-4)
    energy = np.array([r.energies.sum() for r in records])
    assert np.abs(energy / (0.5 * amplitude**2) - 1.0).max() < 1e-4


BAR = Material(200e9, 0.0, 7800.0)
LENGTH, SIDE, CELLS, SPEED = 1.0, 0.1, 50, 1.0
WAVE = float(np.sqrt(BAR.young_modulus / BAR.density))
PLATEAU = SIDE**2 * BAR.density * WAVE * SPEED
"""Contact force A rho c v of the bar that hits the wall, N."""


def _impact() -> Model:
    """A bar that touches a fixed wall; the penalty is as soft as four cells of the bar, which resolve the blow."""
    side = graded([0.0, SIDE], [1])
    bar = hex_block(graded([0.0, LENGTH], [CELLS]), side, side)
    wall = hex_block(graded([LENGTH, LENGTH + SIDE], [1]), side, side)
    bodies = [Body("bar", bar, BAR, "linear"), Body("wall", wall, BAR, "linear")]
    penalty = 0.25 * BAR.young_modulus * CELLS / LENGTH
    pairs = [Pair("hit", "bar.x_max", "wall.x_min", 0.0, penalty)]
    supports = [Support(f"wall.{face}", ("x", "y", "z")) for face in ("x_min", "x_max")]
    return build_model(bodies, pairs=pairs, supports=supports)


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_v21_bar_hits_a_rigid_wall(scheme: str) -> None:
    """V21: force A rho c v0 for 2 L/c, then rebound at -v0, energy kept; 5 % plateau, 1 % energy (manual).

    A wave needs the time of some cells to build up in the penalty and the mesh: the plateau is read from a fifth to
    nine tenths of its duration, the end to 5 %. Central differences damp nothing and lumped quadratic cells disperse
    short waves: their force rings, so means over a tenth of the duration are compared.
    """
    model, duration = _impact(), 2.0 * LENGTH / WAVE
    rest, h = rest_state(model), LENGTH / CELLS / WAVE / 2.0
    transient: Transient | ExplicitTransient
    if scheme == "implicit":
        settings = TransientSettings(h, 0.8, tolerance=1e-8, dispersion_correction=False, solver="superlu")
        transient = Transient(model, rest, no_modes(model, rest), NO_DAMPING, settings, force_scale=PLATEAU)
    else:
        transient = ExplicitTransient(model, rest, NO_DAMPING, ExplicitSettings(h, solver="superlu"))
    velocity = np.zeros((model.n_dof, 1))
    bar = 3 * len(model.bodies[0].mesh.points)
    velocity[0:bar:3] = SPEED
    state = transient.start(np.zeros_like(velocity), velocity)
    first = float(transient.observe(state).energies.sum())
    records = list(transient.march(state, round(1.3 * duration / h)))
    t = h * np.arange(1, len(records) + 1) / duration
    force = np.array([-model.contact.area @ r.contact.traction.reshape(-1, 3)[:, 0] for r in records]) / PLATEAU
    width = round(0.1 * duration / h)
    flat = np.convolve(force[(t > 0.2) & (t < 0.9)], np.full(width, 1.0 / width), "valid")
    assert flat.mean() == pytest.approx(1.0, abs=0.01)
    assert np.abs(flat - 1.0).max() < 0.05
    assert t[force > 0.5][-1] == pytest.approx(1.0, abs=0.05)
    mass = model.mass[:bar][:, :bar]
    momentum = float((mass @ records[-1].state.v[:bar, 0])[::3].sum() / mass[::3][:, ::3].sum())
    assert momentum == pytest.approx(-SPEED, abs=0.05 * SPEED)
    assert np.abs(_total(records) / first - 1.0).max() < 0.01


def _total(records: Sequence[StepRecord]) -> np.ndarray:
    """Stored and dissipated less given energy of the first case, (n_time,) J."""
    return np.array([r.energies[:, 0].sum() + r.state.work[:2, 0].sum() - r.state.work[2, 0] for r in records])


def test_nafems_5t_deep_beam_under_a_step_load() -> None:
    """NAFEMS 5T (forced vibration, R0016): 10 m x 2 m x 2 m, 1 MN/m for t >= 0: 1.043 mm at 0.0117 s, static 0.538 mm.

    Half the simply supported beam with symmetry at mid-span, its load spread over the depth; 2 %: the reference is a
    Timoshenko beam, the ends of a solid are held a little more. Ledger to 1e-8.
    """
    axis = graded([0.0, 2.0], [2])
    body = Body("beam", hex_block(graded([0.0, 5.0], [5]), axis - 1.0, axis), Material(200e9, 0.3, 8000.0), "linear")
    supports = [Support("beam.x_min", ("y",)), Support("beam.x_max", ("x",)), Support("beam.z_min", ("z",))]
    model = build_model([body], supports=supports)
    rest = solve_static(model, model.load, StaticSettings(steps=1, solver="superlu"))
    modes = solve_modes(model, rest, 1, solver="superlu")
    assert modes.omega[0] / (2.0 * np.pi) == pytest.approx(42.65, rel=0.02)
    per_volume = 1e6 / 4.0
    step = time_load(model, Gravity("step", (0.0, -per_volume / 8000.0, 0.0)), lambda _: 1.0)
    settings = TransientSettings(1e-4, 1.0, tolerance=1e-10, dispersion_correction=False, solver="superlu")
    scale = float(np.linalg.norm(step.pattern))
    transient = Transient(model, rest, modes, Rayleigh(5.36, 7.46e-5), settings, force_scale=scale, loads=[step])
    start = np.zeros((model.n_dof, 1))
    records = list(transient.march(transient.start(start, start), 200))
    middle = np.flatnonzero(np.linalg.norm(model.points - [5.0, 0.0, 1.0], axis=1) < 1e-9)[0]
    w = -1e3 * np.array([r.state.u[3 * middle + 1, 0] for r in records])
    assert w.max() == pytest.approx(1.043, rel=0.02)
    assert 1e-4 * (w.argmax() + 1) == pytest.approx(0.0117, rel=0.02)
    static = solve_static(model, step.pattern, StaticSettings(steps=1, solver="superlu")).u
    assert -1e3 * static[3 * middle + 1] == pytest.approx(0.538, rel=0.02)
    given = max(r.state.work[2, 0] for r in records)
    assert np.abs(_total(records)).max() < 1e-8 * given
