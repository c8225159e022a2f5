"""Learning from motions of a known normal form: eigenvalues, held-out errors, modal chart, order, forcing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.learn import Loads, learn
from romgen.polar_form import polar_latex, polar_text
from romgen.reduced_dynamics import LinearPart
from romgen.settings import LearnSettings
from romgen.simulate import coordinates, simulate
from romgen.trajectory import Trajectory
from romgen.trajectory_files import read_trajectories
from tests.lab_study import write_lab_study
from tests.records import example_model

SETTINGS = LearnSettings(internal_resonance=(1, 2), order=3)
SENSORS = ("lower", "mid", "upper")


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Trajectory]:
    folder: Path = tmp_path_factory.mktemp("lab")
    write_lab_study(folder)
    return {t.name: t for t in read_trajectories([folder / "motions.h5"], SENSORS, "m")}


def training(motions: dict[str, Trajectory]) -> list[Trajectory]:
    return [motions[name] for name in ("bending", "torsion", "mixed")]


def test_known_model_is_recovered_from_sensors(motions: dict[str, Trajectory]) -> None:
    learned = learn(training(motions), [motions["other"]], SETTINGS, "lab")
    # differences of order 8: (omega h)^8 / 630 = 1e-10 relative at 196 Hz and 1e-4 s
    assert learned.model.eigenvalues == pytest.approx(example_model().eigenvalues, rel=1e-6)
    # a thousand times the derivative error; a wrong coefficient of any kept term shows as percents
    assert learned.validation[0].nmte_percent < 1e-3
    assert learned.model.internal_resonance == (1, 2)


def test_one_mode_of_two_is_that_of_its_number() -> None:
    """Weakly nonlinear oscillators of 50 and 120 Hz, seen by two sensors: mode 2 alone is a model of the second.

    Its amplitude moves the frequency by parts in a thousand; differences of order 8 leave (2 pi 120/2000)^8/630 = 6e-7.
    """
    t = np.arange(0.0, 1.5, 1.0 / 2000.0)
    rates = np.array([-3.0 + 2j * np.pi * 50.0, -6.0 + 2j * np.pi * 120.0])
    runs = []
    for k, start in enumerate(np.array([[1e-3, 2e-4], [2e-4, 1e-3], [6e-4, 6e-4]])):
        x = (np.exp(t[:, None] * rates) * start).real @ np.array([[1.0, 1.0], [0.5, -0.7]])
        runs.append(Trajectory(f"run{k}", t, ("a", "b"), x))
    for modes in ((1,), (2,), (1, 2)):
        model = learn(runs, [], LearnSettings(master_modes=modes, internal_resonance=(), order=3), "lab").model
        assert model.eigenvalues == pytest.approx(rates[[mode - 1 for mode in modes]], rel=1e-4)


def test_automatic_choices_agree(motions: dict[str, Trajectory]) -> None:
    learned = learn(training(motions), [], LearnSettings(), "lab")
    assert learned.order == 3
    assert learned.orders is not None
    assert learned.orders.tried[0] == 3
    assert learned.model.internal_resonance == (1, 2)


def test_validation_touches_nothing_of_the_model(motions: dict[str, Trajectory]) -> None:
    alone = learn(training(motions), [], SETTINGS, "lab").model
    held_out = replace(motions["other"], displacement=7.0 * motions["other"].displacement[::-1])
    beside = learn(training(motions), [motions["other"], replace(held_out, name="x")], SETTINGS, "lab").model
    assert np.array_equal(alone.normal_form.coefficients, beside.normal_form.coefficients)
    assert np.array_equal(alone.displacement.coefficients, beside.displacement.coefficients)


def modal_decay(name: str, start: tuple[float, float]) -> Trajectory:
    """Two uncoupled linear modes as the FE half would hand them over."""
    t = 1e-3 * np.arange(400)
    roots = np.array([-2.0 + 60.0j, -3.0 + 150.0j])
    motion = np.exp(np.outer(t, roots)) * np.array(start)
    eta, eta_dot, eta_ddot = motion.real, (motion * roots).real, (motion * roots**2).real
    S = np.array([[1.0, 0.5], [0.8, -0.7]])
    snapshots = (eta @ np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 1.0]])).astype(np.float32)[::10]
    return Trajectory(
        name, t, ("a", "b"), eta @ S.T, eta_dot @ S.T, eta, eta_dot, eta_ddot, snapshots, np.arange(0, 400, 10)
    )


def test_modal_chart_gives_forcing_and_full_field() -> None:
    motions = [modal_decay("one", (1.0, 0.2)), modal_decay("two", (0.3, 0.8))]
    loads = Loads(("base_acceleration",), ("m/s2",), np.array([[-0.6], [0.25]]))
    settings = LearnSettings(internal_resonance=(), order=3)
    learned = learn(motions, [modal_decay("three", (0.6, -0.5))], settings, "fe", loads)
    # the ridge of 1e-8 on columns of RMS 1 shrinks coefficients by about that, times the collinearity of the decay
    assert learned.model.eigenvalues == pytest.approx([-2 + 60j, -3 + 150j], rel=1e-6)
    # float32 snapshots
    assert learned.validation[0].nmte_percent < 1e-3
    assert learned.full_field is not None
    # static limit of eta'' + .. = f u: z' = 0 at eta = f u / (lambda conj lambda)
    model = learned.model
    t = np.linspace(0.0, 6.0, 601)
    u = 1e-4 * np.ones((601, 1))
    eta = coordinates(model, simulate(model, t, np.zeros(2, dtype=complex), u))[-1, :2]
    assert eta == pytest.approx(1e-4 * np.array([-0.6 / (4 + 3600), 0.25 / (9 + 22500)]), rel=1e-3)


def test_loads_need_modal_fields(motions: dict[str, Trajectory]) -> None:
    loads = Loads(("f",), ("N",), np.ones((2, 1)))
    with pytest.raises(InputError, match="modal loads need"):
        learn(training(motions), [], SETTINGS, "lab", loads)


def test_a_linear_part_needs_modal_fields(motions: dict[str, Trajectory]) -> None:
    known = LinearPart(np.array([60.0, 150.0]), np.array([0.03, 0.02]))
    with pytest.raises(InputError, match="linear part needs"):
        learn(training(motions), [], SETTINGS, "lab", known=known)


def test_known_modes_are_the_linear_part_of_the_model() -> None:
    """Roots -2.1 + 60i are not those of the data; they stay."""
    motions = [modal_decay("one", (1.0, 0.2)), modal_decay("two", (0.3, 0.8))]
    settings = LearnSettings(internal_resonance=(), order=3)
    roots = np.array([-2.1 + 60.0j, -3.0 + 150.0j])
    known = LinearPart(np.abs(roots), -roots.real / np.abs(roots))
    learned = learn(motions, [], settings, "fe", known=known)
    assert learned.model.eigenvalues == pytest.approx(roots, rel=1e-12)


def test_polar_form_of_the_example() -> None:
    text = polar_text(example_model())
    assert "rho1'/rho1 = -3.2" in text
    assert "Re((0+2i) rho1^2 rho2^-1 exp(i(+2 theta1 -theta2)))" in text
    assert "\\dot{\\theta}_{2} &= +1232.2" in polar_latex(example_model())
