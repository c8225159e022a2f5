"""The ring-downs of the published benchmark model: mixed left out of the training, and where they come to rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from romgen.learn import Learned, learn
from romgen.settings import LearnSettings
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
    bending, torsion = learned.training
    assert bending.sensor_nmte_percent < 1.0
    # residual slip: mean of the last fifth of the samples of the data alone, without any model
    tail = torsion.displacement[-1800:].mean(axis=0)
    slip = 100 * np.linalg.norm(tail) / np.linalg.norm(torsion.displacement, axis=1).max()
    assert torsion.rest_percent == pytest.approx(slip, abs=0.2)
    assert any("comes to rest" in note for note in learned.notes)
