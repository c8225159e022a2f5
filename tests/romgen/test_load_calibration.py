"""Loads of recorded data: from points of a known structure, from its participation, and what is said about both."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from romgen import load_fit
from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.forced_curve import ForcedCurve
from romgen.forced_response import forced_response
from romgen.forcing import chart_input_matrix, sensor_shapes, with_inputs
from romgen.learn import Learned, learn
from romgen.load_calibration import Forcing, InputLoad, calibrate_forcing
from romgen.load_path import load_path
from romgen.load_system import MeasuredPoint
from romgen.reduced_model import ReducedModel
from romgen.settings import ForcedResponseSettings, ForcingSettings, LearnSettings
from romgen.store import read_record, write_record
from tests.forced_truth import EIGENVALUES, SENSORS, SHAPES, STARTS, ringdowns, true_model
from tests.records import same

LOAD = (-1.2, 0.4)


@pytest.fixture(scope="module")
def learned() -> Learned:
    """Learned from the displacement of the sensors alone."""
    *training, validation = ringdowns()
    return learn(training, [validation], LearnSettings(internal_resonance=(1, 2), order=3), "lab")


@pytest.fixture(scope="module")
def known() -> ReducedModel:
    """The structure itself without inputs, with a consistent chart: eta_j = UNIT 2 Re z_j, y = (eta, eta')."""
    truth = true_model(LOAD)
    chart = np.vstack([truth.chart.coefficients[:2], 2.0 * np.diag(EIGENVALUES) @ np.eye(2, 4)])
    scale = np.array([2.5e-3] * 4)
    model = replace(truth, chart=replace(truth.chart, coefficients=chart), scale=scale)
    return with_inputs(model, (), (), np.zeros((2, 0)))


def response(model: ReducedModel, level: float, sensor: str = "mid") -> ForcedCurve:
    settings = ForcedResponseSettings(levels=(level,), sensor=sensor, frequency_range_hz=(104.0, 114.0))
    return forced_response(model, settings).curves[0]


def point(model: ReducedModel, level: float, frequency_hz: float, sensor: str, start: float = 1e-5) -> dict[str, Any]:
    """A point of the frequency response of a model: the amplitude at this level on the branch from rest."""
    row = model.sensors.index(sensor)
    mode = int(np.argmin(np.abs(model.eigenvalues.imag - 2.0 * np.pi * frequency_hz)))
    asked = MeasuredPoint("truth", level, frequency_hz, row, "sqrt2_rms", start, mode)
    path = load_path(model, model.input_matrix[:, 0], asked)
    while path.branch.p.max() < level:
        path = load_path(model, model.input_matrix[:, 0], replace(asked, amplitude=2.0 * path.point.amplitude))
    amplitude = path.amplitude_at_level()
    return {"level": level, "frequency_hz": frequency_hz, "sensor": sensor, "amplitude": amplitude}


def calibrated(model: ReducedModel, *points: dict[str, Any], name: str = "base_acceleration", **keys: Any) -> InputLoad:
    return calibrate_forcing(model, {name: ForcingSettings(points=points, **keys)}).loads[0]


def test_chart_gives_the_input_matrix_of_the_equations(known: ReducedModel) -> None:
    """G of eta_j'' = ... + f_j u in normal-form coordinates, written down independently in ``true_model``."""
    G = chart_input_matrix(known, np.array(LOAD)[:, None])[:, 0]
    # -i f / (2 UNIT omega): the same to the second order of the damping ratios
    np.testing.assert_allclose(G, true_model(LOAD).input_matrix[:, 0], atol=1e-12)
    np.testing.assert_allclose(sensor_shapes(known), SHAPES, rtol=1e-12)


@pytest.mark.parametrize("frequency_hz", [105.0, 109.6, 110.4, 112.0])
def test_points_of_the_model_itself_return_its_load(known: ReducedModel, frequency_hz: float) -> None:
    truth = true_model(LOAD)
    load = calibrated(known, point(truth, 1.5, frequency_hz, "mid"))
    # mode 2 is driven off resonance in the truth: 0.3 0.4 / 1.3 over the square of the frequency ratio, about 1e-3
    assert load.modal_load[0] == pytest.approx(LOAD[0], rel=1e-2)
    assert load.modal_load[1] == 0.0
    assert load.points[0].level_needed == pytest.approx(1.5, rel=1e-9)
    assert load.points[0].model_m == pytest.approx(load.points[0].measured_m, rel=1e-6)


@pytest.mark.parametrize(("level_between", "between_hz"), [(40.0, 145.0), (60.0, 160.0)])
def test_two_modes_with_their_relative_sign(known: ReducedModel, level_between: float, between_hz: float) -> None:
    """Between the modes both answer at once: lower and upper see them in opposite phase.

    From 160 Hz the search with wrong signs ends at the right ones, which leaves no doubt about them either.
    """
    truth = true_model(LOAD)
    points = [
        point(truth, level, hz, sensor)
        for level, hz, sensor in (
            (1.0, 109.9, "mid"),
            (level_between, between_hz, "lower"),
            (level_between, between_hz, "upper"),
            (1.0, 196.0, "upper"),
        )
    ]
    load = calibrated(known, *points, modes=(1, 2))
    np.testing.assert_allclose(load.modal_load, LOAD, rtol=1e-6)
    assert all(abs(p.deviation_percent) < 1e-4 for p in load.points)
    assert not any("relative sign" in note for note in load.notes)


def test_resonant_points_do_not_tell_the_relative_sign(known: ReducedModel) -> None:
    truth = true_model(LOAD)
    load = calibrated(known, point(truth, 1.0, 109.9, "mid"), point(truth, 1.0, 196.0, "upper"))
    # each mode alone answers at its resonance; the other one adds 1e-3
    np.testing.assert_allclose(np.abs(load.modal_load), np.abs(LOAD), rtol=1e-2)
    assert any("do not tell the relative signs" in note for note in load.notes)


def test_signs_that_leave_a_point_out_of_reach_are_passed_over(
    known: ReducedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And where no signs reach the points, the first failure is the answer."""
    truth, residual = true_model(LOAD), load_fit._residual
    points = [point(truth, 1.0, 109.9, "mid"), point(truth, 1.0, 196.0, "upper")]

    def one_sided(problem: load_fit.LoadProblem, start: FloatArray, share: FloatArray) -> FloatArray:
        if share[1] < limit:
            raise InputError("out of reach", where="point 2")
        return residual(problem, start, share)

    monkeypatch.setattr(load_fit, "_residual", one_sided)
    limit = 0.0
    load = calibrated(known, *points, modes=(1, 2))
    np.testing.assert_allclose(np.abs(load.modal_load), np.abs(LOAD), rtol=1e-2)
    limit = np.inf
    with pytest.raises(InputError, match="out of reach"):
        calibrated(known, *points, modes=(1, 2))


def test_sign_is_a_convention(known: ReducedModel) -> None:
    """A base accelerates and mid stays behind; a force pushes it; ``sign`` turns both."""
    one = point(true_model(LOAD), 1.0, 110.0, "mid")
    assert calibrated(known, one).modal_load[0] < 0.0
    assert calibrated(known, one, sign=1).modal_load[0] > 0.0
    assert calibrated(known, one, name="hammer").modal_load[0] > 0.0
    assert calibrated(known, one, name="hammer").unit == "N"


def test_flank_with_a_wrong_frequency_counts_little(known: ReducedModel) -> None:
    """A flank measured 0.1 % off in frequency: its level is 5 % off, the load between it and the peak 1 %."""
    truth = true_model(LOAD)
    peak = response(truth, 1.0)
    shifted = point(truth, 1.0, 111.2, "mid") | {"frequency_hz": 1.001 * 111.2}
    load = calibrated(known, {"level": 1.0, "sensor": "mid", "amplitude": peak.peak_m}, shifted)
    alone = calibrated(known, shifted).modal_load[0] / LOAD[0] - 1.0
    assert alone > 0.04
    assert abs(load.modal_load[0] / LOAD[0] - 1.0) < 0.25 * alone
    assert load.points[1].expected_percent > 2.0 * load.points[0].expected_percent


def test_deviation_covers_noisy_points(known: ReducedModel) -> None:
    """40 sets of three points, 2 % noise in amplitude: the deviation covers 68 % of them, less 3 binomial sigmas."""
    truth, random = true_model(LOAD), np.random.default_rng(3)
    exact = [point(truth, 1.0, hz, "mid") for hz in (108.5, 109.9, 110.2)]
    inside = 0
    for _ in range(40):
        noisy = [p | {"amplitude": p["amplitude"] * (1.0 + 0.02 * random.standard_normal())} for p in exact]
        load = calibrated(known, *noisy)
        off = 100.0 * abs(load.modal_load[0] / LOAD[0] - 1.0)
        inside += off < load.deviation_percent[0]
    assert 40 * 0.683 - 3.0 * np.sqrt(40 * 0.683 * 0.317) < inside


def test_participation_is_the_load(learned: Learned) -> None:
    """Accelerations of two sensors per unit input; the shapes of the data are exact to 1e-6, the load too."""
    shares = {sensor: tuple(SHAPES[SENSORS.index(sensor)] * LOAD) for sensor in ("mid", "upper")}
    table = ForcingSettings(participation=shares)
    load = calibrate_forcing(learned.model, {"base_acceleration": table}).loads[0]
    shapes = sensor_shapes(learned.model)
    np.testing.assert_allclose(shapes * load.modal_load, SHAPES * np.array(LOAD), rtol=1e-4, atol=1e-6)
    assert [note for note in load.notes if "fits its shape" in note] == []
    truth = response(true_model(LOAD), 1.0)
    model = Forcing((load,)).applied(learned.model)
    assert response(model, 1.0).peak_m == pytest.approx(truth.peak_m, rel=0.01)


def test_participation_of_another_structure_is_said(learned: Learned) -> None:
    table = ForcingSettings(participation={"mid": (-1.3, 0.0), "upper": (1.1, 0.0)})
    load = calibrate_forcing(learned.model, {"base_acceleration": table}).loads[0]
    assert any("mode 1 fits its shape in the data to" in note for note in load.notes)


def test_participation_at_a_blind_sensor(known: ReducedModel) -> None:
    blind = replace(known, displacement=replace(known.displacement, coefficients=known.displacement.coefficients * 1.0))
    blind.displacement.coefficients[1, 1] = 0.0
    table = ForcingSettings(participation={"mid": (-1.3, 0.2)})
    with pytest.raises(InputError, match=r"participation: these sensors do not see mode 2; got mid"):
        calibrate_forcing(blind, {"base_acceleration": table})
    table = ForcingSettings(participation={"mid": (-1.3, 0.0)})
    assert calibrate_forcing(blind, {"base_acceleration": table}).loads[0].modal_load[1] == 0.0


def test_two_inputs_are_two_columns(known: ReducedModel) -> None:
    tables = {
        "base_acceleration": ForcingSettings(points=(point(true_model(LOAD), 1.0, 109.9, "mid"),)),
        "hammer": ForcingSettings(participation={"upper": (0.9, -0.5)}),
    }
    forcing = calibrate_forcing(known, tables)
    model = forcing.applied(known)
    assert (model.inputs, model.input_units) == (("base_acceleration", "hammer"), ("m/s2", "N"))
    columns = [chart_input_matrix(known, load.modal_load[:, None])[:, 0] for load in forcing.loads]
    np.testing.assert_array_equal(model.input_matrix, np.column_stack(columns))
    np.testing.assert_allclose(forcing.loads[1].modal_load, np.array([0.9, -0.5]) / SHAPES[2], rtol=1e-12)
    with pytest.raises(InputError, match="load inputs already; got base_acceleration, hammer; find all loads in one"):
        forcing.applied(model)


def test_notes_say_what_the_load_rests_on(known: ReducedModel) -> None:
    truth = true_model(LOAD)
    load = calibrated(known, point(truth, 1.0, 109.9, "mid"))
    text = "\n".join(load.notes)
    assert "calibrated on 1 measured point, and nothing is left to check it by" in text
    assert "taken not to drive mode 2" in text
    assert "mid is taken to accelerate against a positive base_acceleration" in text
    peak = {"level": 1.0, "sensor": "mid", "amplitude": response(truth, 1.0).peak_m}
    load = calibrated(known, peak, peak | {"amplitude": 1.3 * peak["amplitude"]})
    assert load.spread_percent > 10.0
    assert sum("instead of 1; errors of 2 % in amplitude" in note for note in load.notes) >= 1
    assert load.deviation_percent[0] > 5.0


def test_points_outside_the_range_and_on_unstable_parts_are_said(known: ReducedModel) -> None:
    far = {"level": 9.0, "sensor": "mid", "amplitude": 1.1e-3}
    assert any("outside the trained range, 1.25" in note for note in calibrated(known, far).notes)
    between = {"level": 2.0, "sensor": "mid", "amplitude": 0.5e-3, "frequency_hz": 107.5}
    notes = calibrated(known, between).notes
    assert any("point 1: the model is not stable there" in note for note in notes), notes


@pytest.mark.parametrize(
    ("points", "keys", "message"),
    [
        ([{"level": 1.0, "sensor": "middle", "amplitude": 1e-4}], {}, "unknown sensor; got middle"),
        ([{"level": 1.0, "sensor": "mid", "amplitude": 1e-4, "mode": 3}], {}, "no such mode; got 3"),
        (
            [{"level": 1.0, "sensor": "mid", "amplitude": 1e-4}],
            {"modes": (2,)},
            "point 1: the mode nearest to it is not",
        ),
        ([{"level": 1.0, "sensor": "mid", "amplitude": 1e-4}] * 2, {"modes": (1, 2)}, "no point is near this mode"),
        ([{"level": 1.0, "sensor": "mid", "amplitude": 1.0}], {}, "point 1: the model does not reach"),
    ],
)
def test_mistakes_name_the_point(known: ReducedModel, points: Any, keys: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=r"\[forcing.shaker\]") as caught:
        calibrated(known, *points, name="shaker", **keys)
    assert message in str(caught.value)


def test_record_survives_the_store(known: ReducedModel, tmp_path: Any) -> None:
    import h5py

    forcing = Forcing((calibrated(known, point(true_model(LOAD), 1.0, 109.9, "mid")),))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        write_record(file.create_group("forcing"), forcing)
        assert same(read_record(file["forcing"], Forcing), forcing)


def test_truth_decays_as_the_study_says() -> None:
    assert list(STARTS) == [motion.name for motion in ringdowns()]
