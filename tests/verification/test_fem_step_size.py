"""How large a time step may be: frequency and damping of ring-downs of the quick start at 1e-4 and 2e-4 s."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fem.arrays import FloatArray
from fem.campaign import modal_coordinates, snap_back_starts
from fem.modes import ModalBasis, rayleigh, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.transient import Transient, TransientSettings
from romgen.fe_stages import build
from romgen.metrics import analytic_signal
from romgen.settings import load_study

STUDY = Path(__file__).parents[2] / "models" / "clamped_panel" / "study.toml"
DURATION, REFERENCE, GRID = 0.25, 2.5e-5, 2e-4
# Errors up to which a step is fit for ring-downs that a reduced model is learned from.
FREQUENCY_PERCENT, DAMPING_PERCENT = 0.1, 2.0
BENDING, TORSION = (80.0, 140.0), (170.0, 230.0)
"""Hz; the second harmonic of bending lies at 206 to 217 Hz, so torsion is read only where it was released."""


def _rates(eta: FloatArray, band: tuple[float, float]) -> FloatArray:
    """Frequency in Hz and decay rate in 1/s over three stretches of a motion on ``GRID``, (2, 3)."""
    t = np.arange(len(eta)) * GRID
    s = analytic_signal(t, eta, band)
    # A band-pass is not defined within some periods of the ends.
    edges = np.linspace(0.02, t[-1] - 0.03, 4)
    stretches = [(t >= a) & (t <= b) for a, b in pairwise(edges)]
    frequency = [np.polyfit(t[k], np.unwrap(np.angle(s[k])), 1)[0] / (2.0 * np.pi) for k in stretches]
    decay = [-np.polyfit(t[k], np.log(np.abs(s[k])), 1)[0] for k in stretches]
    return np.array([frequency, decay])


def _motions(steps: tuple[float, ...]) -> list[FloatArray]:
    """Both master modes in bending, torsion and mixed ring-downs on ``GRID``, (n_time, 2, 3) per step."""
    study = load_study(STUDY)
    assert study.ringdowns is not None
    model = build(study)
    rest = solve_static(model, model.load, StaticSettings(study.preload.steps, study.preload.tolerance))
    modes = solve_modes(model, rest, study.modes.count)
    etas = [modal_coordinates(modes, start.amplitudes) for start in study.ringdowns.training]
    scale = max(float(np.linalg.norm(modes.left[:, :2] @ (modes.omega[:2] ** 2 * eta))) for eta in etas)

    def ready(step: float) -> Transient:
        damping = rayleigh(modes, (0, 1), study.modes.damping_ratio)
        return Transient(model, rest, modes, damping, TransientSettings(step), force_scale=scale)

    starts = snap_back_starts(ready(GRID), modes, etas)
    return [_marched(ready(step), modes, starts.displacement, starts.slip) for step in steps]


def _marched(transient: Transient, modes: ModalBasis, displacement: FloatArray, slip: FloatArray) -> FloatArray:
    step = transient.settings.time_step
    state = transient.start(displacement, np.zeros_like(displacement), slip, settled=True)
    eta = [modes.left[:, :2].T @ displacement]
    eta += [
        modes.left[:, :2].T @ (r.state.u - transient.equilibrium.u[:, None])
        for r in transient.march(state, round(DURATION / step))
    ]
    return np.array(eta)[:: round(GRID / step)]


@pytest.mark.slow
def test_frequency_and_damping_of_ring_downs_at_two_steps() -> None:
    """Against steps of 2.5e-5 s; 0.25 s from 2 mm with contact, friction and the 1:2 resonance."""
    reference, *others = _motions((REFERENCE, 1e-4, 2e-4))
    for case, mode, band in [(0, 0, BENDING), (1, 1, TORSION), (2, 0, BENDING)]:
        truth = _rates(reference[:, mode, case], band)
        for eta in others:
            frequency, damping = 100.0 * np.abs(_rates(eta[:, mode, case], band) / truth - 1.0)
            assert frequency.max() < FREQUENCY_PERCENT
            assert damping.max() < DAMPING_PERCENT
