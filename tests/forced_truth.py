"""A known structure with a known load: free decays and forced answers of three sensors from one cubic normal form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from romgen.arrays import FloatArray
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors, simulate
from romgen.trajectory import Trajectory
from tests.normal_form_models import linear_charts

SENSORS = ("lower", "mid", "upper")
SHAPES = np.array([[1.0, -0.8], [1.1, 0.3], [0.9, 0.9]])
UNIT = 2.5e-3
"""Metres of modal displacement per Re z, so that eta_j = UNIT 2 Re z_j."""
EIGENVALUES = np.array([-3.2 + 694.1j, -6.5 + 1232.2j])
STARTS = {"bending": (0.16, 0.0), "torsion": (0.0, 0.12), "mixed": (0.1, 0.09), "other": (0.13, 0.05)}


def true_model(modal_load: tuple[float, float], name: str = "base_acceleration") -> ReducedModel:
    """The structure of the benchmark to cubic terms; eta_j'' = ... + modal_load_j u, m/s^2 per input unit.

    z_j' = ... + G_j u with G_j = -i f_j / (2 UNIT omega_j): then eta' does not feel u, and eta'' does by f_j.
    """
    E = np.array([[0, 1, 1, 0], [2, 0, 1, 0], [1, 1, 0, 1], [2, 0, 0, 0], [1, 1, 1, 0], [0, 2, 0, 1]])
    first = [24.9 + 18.9j, -12.3 - 953.7j, -16.5 - 292.1j, 0.0, 0.0, 0.0]
    second = [0.0, 0.0, 0.0, -9.4 + 10.6j, -20.0 + 163.4j, -23.2 + 227.9j]
    terms = PolynomialMap(E, np.array([first, second], dtype=np.complex128))
    load = -1j * np.array(modal_load) / (2.0 * UNIT * EIGENVALUES.imag)
    model = linear_charts(EIGENVALUES, terms, load, (1, 2), np.array([0.16, 0.12]))
    maps: PolynomialMap[np.float64] = PolynomialMap(
        np.eye(4, dtype=np.int64), np.hstack([UNIT * SHAPES, np.zeros((3, 2))])
    )
    return replace(model, displacement=maps, velocity=maps, sensors=SENSORS, inputs=(name,), input_units=("m/s2",))


def ringdowns(noise: float = 0.0) -> list[Trajectory]:
    """Four decays of 0.5 s at 10 kHz; ``noise`` is the standard deviation of white noise, m."""
    t, model, random = 1e-4 * np.arange(5001), true_model((0.0, 0.0)), np.random.default_rng(7)
    motions = []
    for name, start in STARTS.items():
        x: FloatArray = sensors(model, simulate(model, t, np.array(start, dtype=np.complex128)))[0]
        motions.append(Trajectory(name, t, SENSORS, x + noise * random.standard_normal(x.shape)))
    return motions
