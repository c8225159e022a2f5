"""V28: frequency of a hinged beam with immovable ends against its amplitude, from ring-downs of solid elements."""

from __future__ import annotations

import numpy as np
import pytest

import fem
from fem.modes import Rayleigh
from fem.snap_back import hold_modes
from fem.transient import Transient, TransientSettings

LENGTH, HEIGHT, STEPS = 1.0, 0.01, 100


def _half_beam() -> fem.Model:
    """x = 0 is the plane of symmetry; the end turns about the mid-line of its face, which cannot move."""
    lines = [fem.graded([0.0, 0.5 * LENGTH], [10])]
    lines += [fem.graded([-0.5 * HEIGHT, 0.5 * HEIGHT], [1]), fem.graded([0.0, HEIGHT], [1])]
    mesh = fem.hex_block(*lines).with_region("hinge", fem.within(x=(0.5 * LENGTH, 0.5 * LENGTH), y=(0.0, 0.0)))
    supports = [fem.Support(f"beam.{side}", ("normal",)) for side in ("x_min", "z_min", "z_max")]
    body = fem.Body("beam", mesh, fem.Material(200e9, 0.0, 7800.0))
    return fem.build_model([body], supports=[*supports, fem.Support("beam.hinge", ("x", "y"))])


def _frequency_ratio(model: fem.Model, share: float) -> float:
    """Nonlinear over linear frequency of a release from mid-span at ``share`` radii of gyration."""
    rest = fem.rest_state(model)
    modes = fem.solve_modes(model, rest, 2, solver="superlu")
    middle = np.intersect1d(model.bodies[0].mesh.nodes("x_min"), model.bodies[0].mesh.nodes("y_min"))[0]
    eta = np.array([share * HEIGHT / np.sqrt(12.0) / modes.shapes[3 * middle + 1, 0]])
    held = hold_modes(model, rest, modes, eta, solver="superlu")
    # Steps of a hundredth of the period that Woinowsky-Krieger's perturbation 1 + 3/32 (a/r)^2 predicts.
    step = 2.0 * np.pi / modes.omega[0] / (1.0 + 3.0 / 32.0 * share**2) / STEPS
    settings = TransientSettings(step, 1.0, tolerance=1e-6, dispersion_correction=False, solver="superlu")
    inertia = float(np.linalg.norm(modes.left[:, 0] * modes.omega[0] ** 2 * eta[0]))
    transient = Transient(model, rest, modes, Rayleigh(0.0, 0.0), settings, force_scale=inertia)
    start = transient.start(held.u[:, None], np.zeros((model.n_dof, 1)), held.contact.slip)
    q = [float(eta[0]), *(float(modes.left[:, 0] @ s.state.u[:, 0]) for s in transient.march(start, 2 * STEPS + 20))]
    before = np.flatnonzero(np.array(q[:-1]) * np.array(q[1:]) < 0.0)
    crossings = [step * (k - q[k] / (q[k + 1] - q[k])) for k in before]
    return float(np.pi / np.diff(crossings).mean() / modes.omega[0])


@pytest.mark.parametrize(("share", "exact"), [(0.5, 1.02313), (1.0, 1.08916), (2.0, 1.31778), (3.0, 1.62568)])
def test_v28_stretching_raises_the_frequency(share: float, exact: float) -> None:
    """V28: Woinowsky-Krieger, J. Appl. Mech. 17 (1950) 35-36; 1 % as in the manual.

    The theory is that of the slender limit and of the sine shape at all amplitudes; L/h = 100 here. Average
    acceleration at a hundred steps per period lowers the frequency by (pi/50)^2/12 = 3.3e-4.
    """
    assert _frequency_ratio(_half_beam(), share) == pytest.approx(exact, rel=0.01)
