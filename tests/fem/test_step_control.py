"""Step sizes: cut-back, refreshed factors, local error, interpolation, and restarts in the middle of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem.campaign import Observation, march_campaign, modal_coordinates, modal_starts
from fem.errors import FemConvergenceError, FemInputError
from fem.material import Material
from fem.model import Body, Model, Support, build_model
from fem.modes import ModalBasis, Rayleigh, no_modes, solve_modes
from fem.motion import MotionState, StepRecord
from fem.preload import StaticSettings, StaticState, solve_static
from fem.snap_back import hold_modes
from fem.step_control import StepControl, modal_deflection
from fem.transient import Transient, TransientSettings
from tests.fem.conftest import Strip
from tests.fem.small_models import box
from tests.records import same

H = 1e-4
VIOLENT = 2e-3
"""Peak in m of a start along the mode shape that the strip, 2 mm thick, does not follow in steps of H."""


def of_strip(strip: Strip, **options: object) -> Transient:
    scale = float(np.linalg.norm(strip.modes.left[:, 0] * strip.modes.omega[0] ** 2 * strip.eta))
    settings = replace(TransientSettings(H, corrected_modes=1, solver="superlu"), **options)
    return Transient(strip.model, strip.equilibrium, strip.modes, strip.damping, settings, force_scale=scale)


def struck(strip: Strip, transient: Transient, peak: float = VIOLENT) -> MotionState:
    """Released along the mode shape with all its acceleration: everything else has to settle, the hard way."""
    starts = modal_starts(strip.modes, strip.equilibrium, [modal_coordinates(strip.modes, (peak,))])
    return transient.start(starts.displacement, np.zeros_like(starts.displacement), starts.slip, settled=True)


def test_cut_back_cures_a_violent_start_and_comes_back_to_the_grid(strip: Strip) -> None:
    """Without halving the march fails; with it the motion is that of eight times finer steps within their own error."""
    stiff = of_strip(strip, max_cutbacks=0)
    with pytest.raises(FemConvergenceError, match="smaller time step"):
        list(stiff.march(struck(strip, stiff), 40))
    transient = of_strip(strip)
    records = list(transient.march(struck(strip, transient), 40))
    assert [r.state.step for r in records] == list(range(1, 41))
    assert [r.state.pace.position for r in records] == [float(n) for n in range(1, 41)]
    assert sum(r.effort.rejected for r in records) > 0
    assert sum(r.effort.substeps for r in records) > 40
    finer = of_strip(strip, time_step=H / 8)
    reference = [r for r in finer.march(struck(strip, finer), 320) if r.state.step % 8 == 0]
    finest = of_strip(strip, time_step=H / 16)
    converged = [r for r in finest.march(struck(strip, finest), 640) if r.state.step % 16 == 0]

    def mode(found: list[StepRecord]) -> np.ndarray:
        return np.array([strip.modes.left[:, 0] @ (r.state.u[:, 0] - strip.equilibrium.u) for r in found])

    left = np.abs(mode(reference) - mode(converged)).max()
    # Second order: steps of H err 64 times as much as steps of H/8, whose own error is 4/3 of their change.
    assert np.abs(mode(records) - mode(converged)).max() < 64.0 * 4.0 / 3.0 * left + left


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_unresolved_modes_start_quietly(strip: Strip, rho: float) -> None:
    """Along the mode shape at its whole thickness: energy never grows; the full acceleration ruins the ledger."""
    top, worst = {}, {}
    for settled in (False, True):
        transient = of_strip(strip, spectral_radius=rho)
        starts = modal_starts(strip.modes, strip.equilibrium, [modal_coordinates(strip.modes, (VIOLENT,))])
        start = transient.start(starts.displacement, 0.0 * starts.displacement, starts.slip, settled=settled)
        at_rest = transient.rest_energies.sum()
        first = float(transient.observe(start).energies.sum() - at_rest)
        records = list(transient.march(start, 40))
        energy = np.array([float(r.energies.sum() - at_rest) for r in records])
        spent = np.array([r.state.work[:2, 0].sum() - r.state.work[2, 0] for r in records])
        top[settled], worst[settled] = energy.max() / first, np.abs(energy - first + spent).max() / first
    assert top[False] <= 1.0
    # What the scheme takes from the modes that it does not resolve.
    assert worst[False] < 1.0
    assert worst[True] > 10.0


def test_refreshed_factor_saves_iterations_and_keeps_the_motion(strip: Strip) -> None:
    """Near its state the factor of the current tangent halves the iterations; the tolerance decides the answer."""
    eta = modal_coordinates(strip.modes, (VIOLENT,))
    held = hold_modes(strip.model, strip.equilibrium, strip.modes, eta, steps=16, solver="superlu")
    displacement, runs = (held.u - strip.equilibrium.u)[:, None], {}
    for above in (0, 6):
        transient = of_strip(strip, time_step=H / 4, tolerance=1e-7, refactor_above=above)
        start = transient.start(displacement, 0.0 * displacement, held.contact.slip, settled=True)
        runs[above] = list(transient.march(start, 60))
    assert runs[6][0].effort.factors == 1
    assert not any(r.effort.factors for r in runs[0])
    assert runs[6][1].iterations[0] < 0.5 * runs[0][1].iterations[0]
    assert sum(r.iterations[0] for r in runs[6]) < sum(r.iterations[0] for r in runs[0])
    motion = {above: np.array([r.state.u[:, 0] - strip.equilibrium.u for r in run]) for above, run in runs.items()}
    # Steps agree to 1e-7 (test_transient.py); their difference adds up, at worst with the square of their number.
    np.testing.assert_allclose(motion[6], motion[0], atol=0.5 * 60**2 * 1e-7 * np.abs(motion[0]).max())


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"refactor_above": 8},
        {"error_tolerance": 1e-2},
        {"error_tolerance": 3e-2, "max_doublings": 2},
        {"method": "newton"},
    ],
    ids=["cut-back", "refreshed", "adaptive", "doubled", "newton"],
)
def test_restart_in_pieces_repeats_the_march_bit_by_bit(strip: Strip, options: dict[str, object]) -> None:
    """A fresh transient at every seam; the seams fall inside doubled steps and while steps are cut back."""
    peak = 2e-4 if {"error_tolerance", "method"} & set(options) else VIOLENT
    transient = of_strip(strip, **options)
    whole = list(transient.march(struck(strip, transient, peak), 17))
    state, pieces = struck(strip, transient, peak), []
    for count in (3, 4, 5, 5):
        fresh = of_strip(strip, **options)
        piece = list(fresh.march(state, count))
        state = piece[-1].resume
        pieces += piece
    for again, first in zip(pieces, whole, strict=True):
        # Its own restart point inside a long step included.
        assert same(again, first)
    assert any(r.effort.substeps != 1 for r in whole) or options.get("method") == "newton"


def test_failed_march_hands_on_what_it_computed(strip: Strip) -> None:
    transient = of_strip(strip, max_cutbacks=0)
    starts = modal_starts(strip.modes, strip.equilibrium, [modal_coordinates(strip.modes, (VIOLENT,))])
    starts = replace(starts, settled=True)
    observation = Observation(strip.modes, np.zeros((0, strip.model.n_dof)), 10)
    segments = []
    with pytest.raises(FemConvergenceError):
        segments.extend(march_campaign(transient, observation, 40, 40, starts=starts))
    # The generator has yielded before it raised: extend kept it.
    assert len(segments) == 1
    assert segments[0].steps[-1] == segments[0].state.step < 40


Linear = tuple[Model, StaticState, ModalBasis]


@pytest.fixture(scope="module")
def beam() -> Linear:
    """A linear cantilever: one mode of it is a linear oscillator."""
    body = Body("beam", box((0.2, 0.01, 0.02), (2, 1, 1)), Material(200e9, 0.3, 7800.0), "linear")
    model = build_model([body], supports=[Support("beam.x_min", ("x", "y", "z"))])
    rest = solve_static(model, model.load, StaticSettings(steps=1, solver="superlu"))
    return model, rest, solve_modes(model, rest, 2, solver="superlu")


def of_beam(beam: Linear, per_period: float, rho: float, **options: object) -> Transient:
    model, rest, modes = beam
    step = 2.0 * np.pi / float(modes.omega[0]) / per_period
    scale = float(np.linalg.norm(modes.left[:, 0] * modes.omega[0] ** 2))
    settings = TransientSettings(step, rho, tolerance=1e-9, dispersion_correction=False, solver="superlu")
    return Transient(model, rest, modes, Rayleigh(0.0, 0.0), replace(settings, **options), force_scale=scale)


def plucked(beam: Linear, transient: Transient) -> MotionState:
    """First mode at eta = 1."""
    shape = beam[2].shapes[:, :1]
    return transient.start(shape, np.zeros_like(shape), settled=True)


def eta(beam: Linear, record: StepRecord) -> tuple[float, float]:
    left = beam[2].left[:, 0]
    return float(left @ record.state.u[:, 0]), float(left @ record.state.v[:, 0])


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9, 1.0])
def test_error_estimate_is_the_local_error(beam: Linear, rho: float) -> None:
    """After the parasitic root has died out: u_(n+1) against the exact motion from u_n, v_n, within 5 wh.

    At rho = 1 the start itself is exact in a, elsewhere rho^20 of its shift is left.
    """
    transient = of_beam(beam, 200.0, rho, error_tolerance=1e6)
    control, omega = StepControl(0, 0, 1.0, 60, 0, apart=False), float(beam[2].omega[0])
    h = transient.settings.time_step
    estimates, errors, old = [], [], plucked(beam, transient)
    for record in transient.march(old, 150):
        if record.state.step > 60:
            left = beam[2].left[:, 0]
            u, v = float(left @ old.u[:, 0]), float(left @ old.v[:, 0])
            exact = u * np.cos(omega * h) + v / omega * np.sin(omega * h)
            errors.append(abs(eta(beam, record)[0] - exact))
            estimates.append(
                control.error(transient._equation(0), old, record, np.zeros(1)) * record.state.pace.peak[0]
            )
        old = record.state
    np.testing.assert_allclose(estimates, errors, atol=5.0 * omega * h * max(errors))


@pytest.mark.parametrize("rho", [0.5, 1.0])
def test_changing_step_sizes_keep_second_order(beam: Linear, rho: float) -> None:
    """Steps of 1, 1/4, 1/4, 1/2, 1/2, 1/2 intervals: the error over two periods falls with slope 2 +- 0.1 (V22)."""
    errors = []
    for per_period in (40, 80, 160):
        transient = of_beam(beam, per_period, rho)
        state, worst = plucked(beam, transient), 0.0
        for n in range(2 * per_period):
            state = replace(state, pace=replace(state.pace, level=(0, 2, 1)[n % 3]))
            (record,) = transient.march(state, 1)
            # Quarters become halves as soon as the grid allows.
            assert record.effort.substeps == (1, 3, 2)[n % 3]
            worst = max(worst, abs(eta(beam, record)[0] - np.cos(2.0 * np.pi * (n + 1) / per_period)))
            state = record.resume
        errors.append(worst)
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([2.0, 2.0], abs=0.1)


def test_adaptive_error_follows_its_tolerance(beam: Linear) -> None:
    """With e ~ h^3 per step the error of the motion, ~ h^2, falls with tolerance^(2/3): 64 in tolerance give 16.

    Step sizes are powers of two, so that single ratios scatter by up to 4; from end to end two of them cancel.
    """
    errors, steps = [], []
    for tolerance in (6.4e-3, 1e-4, 1.5625e-6):
        transient = of_beam(beam, 10.0, 1.0, error_tolerance=tolerance, max_doublings=1, max_cutbacks=8)
        records = list(transient.march(plucked(beam, transient), 20))
        exact = np.cos(2.0 * np.pi * np.arange(1, 21) / 10.0)
        errors.append(np.abs(np.array([eta(beam, r)[0] for r in records]) - exact).max())
        steps.append(sum(r.effort.substeps for r in records))
    assert steps[0] < steps[1] < steps[2]
    assert 64.0 < errors[0] / errors[2] < 1024.0


def test_outputs_inside_a_doubled_step_lie_on_the_motion(beam: Linear) -> None:
    """Steps of four intervals: the interpolated outputs err no more than twice as much as those at the step ends."""
    transient = of_beam(beam, 400.0, 1.0, error_tolerance=1e-3, max_doublings=2)
    records = list(transient.march(plucked(beam, transient), 400))
    assert max(r.effort.substeps for r in records) == 1
    assert sum(r.effort.substeps for r in records) < 110
    error = np.array([eta(beam, r)[0] for r in records]) - np.cos(2.0 * np.pi * np.arange(1, 401) / 400.0)
    ends = np.array([r.state is r.resume for r in records])
    assert ends.sum() > 90
    assert np.abs(error[~ends]).max() < 2.0 * np.abs(error[ends]).max()
    # Energy of every output, interpolated ones too: the ledger of the linear beam has no loss to within (wh)^2/12.
    total = np.array([r.energies[:, 0].sum() for r in records])
    assert np.abs(total / total[0] - 1.0).max() < (2.0 * np.pi / 100.0) ** 2 / 12.0


def test_error_tolerance_out_of_reach_is_named(beam: Linear) -> None:
    transient = of_beam(beam, 10.0, 1.0, error_tolerance=1e-9, max_cutbacks=1)
    with pytest.raises(FemConvergenceError, match="local error is above its tolerance at the smallest step"):
        list(transient.march(plucked(beam, transient), 1))


@pytest.mark.parametrize(
    ("options", "message"),
    [({"method": "magic"}, "unknown method"), ({"error_tolerance": 0.0}, "positive"), ({"time_step": 0.0}, "positive")],
)
def test_settings_that_make_no_sense_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(FemInputError, match=message):
        replace(TransientSettings(1e-4), **options)


def test_load_deflects_a_beam_by_its_modes(beam: Linear) -> None:
    """A static state under M phi_1: eta = 1 / omega^2. Without modes there is none."""
    model, rest, modes = beam
    load = model.mass @ modes.shapes[:, :1]
    assert modal_deflection(modes, load, 0.0) == pytest.approx(modes.omega[0] ** -2, rel=1e-9)
    assert modal_deflection(no_modes(model, rest), load, 1.0) == 0.0
