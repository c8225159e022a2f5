"""The ring-downs of the published benchmark model: mixed left out of the training, and where they come to rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from romgen.learn import Learned, learn
from romgen.model_stages import share_out
from romgen.settings import DataSettings, LearnSettings
from romgen.trajectory_files import read_trajectories

DATA = Path(__file__).parents[2].parent / "shared" / "data"
SENSORS = ("lower", "mid", "upper")


def mixed_left_out(path: Path) -> Learned:
    bending, torsion, mixed = read_trajectories([path], SENSORS, "m")
    return learn([bending, torsion], [mixed], LearnSettings(internal_resonance=(1, 2), order=5), "benchmark")


@pytest.mark.slow
def test_mixed_ringdown_is_predicted_from_the_other_two() -> None:
    """Its start is the mean of the other two; the published model has 9.16 % on unseen data, the target is 5 %."""
    path = DATA / "trc_comsol_training.mat"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    learned = mixed_left_out(path)
    assert learned.orders.method == "trajectories"
    assert learned.validation[0].sensor_nmte_percent < 5.0
    # the limit of small motions is that of the data, so the first sample alone is a start too
    assert learned.validation[0].first_sample_percent < 5.0
    bending, torsion = learned.training
    assert bending.sensor_nmte_percent < 1.0
    # residual slip: mean of the last fifth of the samples of the data alone, without any model
    tail = torsion.displacement[-1800:].mean(axis=0)
    slip = 100 * np.linalg.norm(tail) / np.linalg.norm(torsion.displacement, axis=1).max()
    assert torsion.rest_percent == pytest.approx(slip, abs=0.2)
    assert any("comes to rest" in note for note in learned.notes)
    # beside the error itself: the slip is taken off
    assert torsion.about_rest_percent < torsion.sensor_nmte_percent


@pytest.mark.slow
def test_all_three_ringdowns_meet_their_targets_as_far_as_one_equilibrium_can() -> None:
    """Bending and mixed below 1 %; the torsion decay rests 2 % of its largest motion off, so its target is missed."""
    path = DATA / "trc_comsol_training.mat"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    learned = learn(read_trajectories([path], SENSORS, "m"), [], LearnSettings(), "benchmark")
    bending, _, mixed = learned.training
    assert learned.orders.method == "trajectories"
    assert max(bending.sensor_nmte_percent, mixed.sensor_nmte_percent) < 1.0
    # published for the order-7 model on unseen data: 9.16 %
    assert max(error.first_sample_percent for error in learned.training) < 9.16
    assert learned.model.stability is not None
    assert learned.model.stability.is_stable
    # tails of the decays by a straight line through log amplitude and phase: 3.3 to 3.4 1/s, 110.8 to 111.2 Hz
    assert learned.model.eigenvalues[0].real == pytest.approx(-3.35, rel=0.05)
    assert learned.model.eigenvalues[0].imag / (2.0 * np.pi) == pytest.approx(111.0, rel=0.005)


@pytest.mark.slow
def test_ringdowns_counted_from_where_they_come_to_rest_meet_all_targets() -> None:
    """Targets 1, 1.5 and 1 % of training with at most order 7, stable: about the rest position of each decay."""
    path = DATA / "trc_comsol_training.mat"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    data = DataSettings(files=(path,), sensors=SENSORS, unit="m", training=(0, 1, 2), zero="rest")
    learned = learn(share_out(data).training, [], LearnSettings(order=7), "benchmark")
    bending, torsion, mixed = (error.sensor_nmte_percent for error in learned.training)
    assert max(bending, mixed) < 1.0
    assert torsion < 1.5
    assert max(error.rest_percent for error in learned.training) < 0.1
    assert learned.model.stability is not None
    assert learned.model.stability.is_stable
