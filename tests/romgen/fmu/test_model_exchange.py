"""Model Exchange: an own driver that sets the inputs at every stage of an adaptive solver."""

from __future__ import annotations

import numpy as np

from romgen.fmu.check import replay_difference
from romgen.fmu.model_exchange import replay_model_exchange
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel
from romgen.simulate import simulate_reference


def test_dop853_through_the_interface_equals_the_python_model(native: FmuExport, model: ReducedModel) -> None:
    """Both by DOP853 at 1e-12 with a linear input; the limit is that of two adaptive runs."""
    t = np.linspace(0.0, 0.01, 11)
    slope = np.array([3e3, -1e3])
    z0 = np.array([0.3 + 0.1j, 0.4j])
    run = replay_model_exchange(native.path, t, z0, lambda time: slope * time)
    z = simulate_reference(model, t, z0, t[:, None] * slope, hold="linear", rtol=1e-12)
    assert replay_difference(run, model, z) <= 1e-9
