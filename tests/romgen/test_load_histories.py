"""Functions of time on load inputs: samples from study and CSV, the march, the comparison, report and summary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from romgen import fe_stages, fe_transients
from romgen.errors import InputError
from romgen.load_histories import compare_history, history_motion, load_samples
from romgen.reduced_model import ReducedModel
from romgen.report.history_figures import history_figure, history_table
from romgen.settings import LoadHistorySettings, Study, StudyError, load_study
from romgen.simulate import sensors, simulate
from romgen.stage import table_content
from tests.normal_form_models import averaged_oscillator
from tests.romgen.test_excited_study import EXCITED

PULSE = LoadHistorySettings(
    input="base_acceleration", times=(0.0, 1.0, 2.0), values=(0.0, 1.0, 0.0), scale=0.01, duration=6.0
)


@pytest.fixture(scope="module")
def model() -> ReducedModel:
    return averaged_oscillator(1.5j, damping=0.01)


def _pulse(model: ReducedModel) -> LoadHistorySettings:
    return PULSE.model_copy(update={"input": model.inputs[0]})


def test_samples_are_linear_between_and_zero_outside(tmp_path: Path) -> None:
    """From arrays and from a CSV with a header and a blank line alike."""
    path = tmp_path / "pulse.csv"
    path.write_text("t,a\n0.0,0.0\n1.0,1.0\n\n2.0;0.0\n", encoding="utf-8")
    from_file = LoadHistorySettings(input="x", file=path, scale=0.01)
    for table in (PULSE, from_file):
        samples = load_samples("pulse", table)
        np.testing.assert_allclose(samples.at(np.array([-1.0, 0.5, 1.0, 1.5, 3.0])), [0.0, 5e-3, 1e-2, 5e-3, 0.0])


def test_csv_of_spreadsheets_keeps_its_first_sample(tmp_path: Path) -> None:
    """A byte order mark before the first number, decimal commas."""
    path = tmp_path / "pulse.csv"
    path.write_text("0,0;1,5\n1,0;0,5\n", encoding="utf-8-sig")
    samples = load_samples("pulse", LoadHistorySettings(input="x", file=path))
    np.testing.assert_array_equal(samples.at(np.array([0.0, 0.5, 1.0])), [1.5, 1.0, 0.5])


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0,5,1,5\n1,0\n2,0\n", "line 1 of .* is no sample"),
        ("0,0\n1,x\n", "line 2 of .* is no sample"),
        ("0,0\n0,1\n", "not a load history"),
        ("0,0\n", "not a load history"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=problem):
        load_samples("bad", LoadHistorySettings(input="x", file=path))


def test_every_case_is_driven_by_its_own_input() -> None:
    """Two inputs, three histories: (n_case,) amplitudes, 0 where another input drives the case."""
    other = PULSE.model_copy(update={"input": "shaker", "scale": 2.0, "duration": None})
    motion = history_motion({"a": PULSE, "b": other, "c": PULSE}, 12, 0.1)
    assert motion.displacement.shape == (12, 3)
    assert motion.n_step == 60
    np.testing.assert_allclose(motion.loads["base_acceleration"](1.0), [0.01, 0.0, 0.01])
    np.testing.assert_allclose(motion.loads["shaker"](1.0), [0.0, 2.0, 0.0])


def test_the_model_agrees_with_itself(model: ReducedModel) -> None:
    """Fed with its own motion it is exact; with 1.25 times that the peaks say so and the NMTE is not zero."""
    table = _pulse(model)
    t = np.linspace(0.0, 8.0, 801)
    u = load_samples("pulse", table).at(t)[:, None]
    z = simulate(model, t, np.zeros(len(model.eigenvalues), dtype=complex), u)
    x = sensors(model, z)[0]
    found = compare_history(model, "pulse", table, t, x)
    assert len(found.t) == 601
    assert found.nmte_percent < 1e-3
    assert found.range_share == pytest.approx(float((np.abs(z[:601]) / model.trained_amplitude).max()), rel=1e-3)
    off = compare_history(model, "pulse", table, t, 1.25 * x)
    assert off.fe_peak_m / off.rom_peak_m == pytest.approx(1.25, rel=1e-3)
    assert off.nmte_percent == pytest.approx(
        0.2 * 100.0 * np.linalg.norm(x[:601], axis=1).mean() / np.linalg.norm(x[:601], axis=1).max(), rel=1e-2
    )


def test_report_shows_table_and_curves(model: ReducedModel) -> None:
    table = _pulse(model)
    t = np.linspace(0.0, 6.0, 601)
    found = compare_history(model, "pulse", table, t, np.ones((601, len(model.sensors))))
    assert history_table((found,)).rows[0][0] == "pulse"
    figure = history_figure((found, found))
    assert len(figure.tables) == 2


HISTORY = (
    EXCITED
    + """
[load_histories.blow]
input = "shaker"
file = "blow.csv"
[load_histories.gust]
input = "wind"
times = [0.0, 1e-4, 2e-4]
values = [0.0, 50.0, 0.0]
"""
)


def _study(folder: Path, text: str = HISTORY) -> Study:
    (folder / "blow.csv").write_text("0,0\n1e-4,2\n3e-4,0\n", encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


def test_key_of_the_stage_follows_the_file(tmp_path: Path) -> None:
    study = _study(tmp_path)
    before = table_content(study, "load_histories")
    (tmp_path / "blow.csv").write_text("0,0\n1e-4,3\n3e-4,0\n", encoding="utf-8")
    after = table_content(study, "load_histories")
    assert before["blow"] != after["blow"]
    assert before["gust"] == after["gust"]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('input = "wind"', 'input = "wnd"', "gust.* unknown load input 'wnd'; did you mean 'wind'"),
        ('file = "blow.csv"', 'file = "none.csv"', "blow.* no such file"),
        ('file = "blow.csv"\n', "", "blow.* needs either file, or times and values"),
        ("[0.0, 50.0, 0.0]", "[0.0, 50.0]", "gust.* has 3 times but 2 values"),
    ],
)
def test_wrong_histories_are_named(tmp_path: Path, old: str, new: str, problem: str) -> None:
    with pytest.raises(StudyError, match=problem):
        _study(tmp_path, HISTORY.replace(old, new))


def test_both_histories_march_together(tmp_path: Path) -> None:
    """The tiny strip, one case struck at a point and one under a pressure: momentum of the impulse.

    While the pulse is short against all periods, mode 1 gains Phi' p times the impulse: eta_dot = L int F dt.
    """
    study = _study(tmp_path)
    preload = fe_stages.solve_preload(study, lambda _fraction, _text: None)
    modes = fe_stages.solve_modes(study, preload)
    table = study.ringdowns
    assert table is not None
    fine = study.model_copy(update={"ringdowns": table.model_copy(update={"time_step": 1e-5})})
    short = {name: item.model_copy(update={"duration": 1e-4}) for name, item in study.load_histories.items()}
    motion = history_motion(short, len(modes.shapes), 1e-5)
    segments = list(fe_transients.march_forced(fine, preload, modes, motion, None))
    eta_dot = np.concatenate([s.eta_dot for s in segments])[-1, 0]
    impulse = np.array([0.5 * 1e-4 * 2.0 * modes.modal_load[0, 1], 0.5 * 1e-4 * 50.0 * modes.modal_load[0, 2]])
    # (omega t)^2 / 12 with omega t = 0.28 of the impulse is taken back by the spring: 0.7 %.
    np.testing.assert_allclose(eta_dot, impulse, rtol=0.03)
