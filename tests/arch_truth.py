"""A shallow arch of two modes, written down as eta'' = ...: sensors, free decays and exact forced answers."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np

from romgen.arrays import ComplexArray
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors, simulate
from romgen.trajectory import Trajectory
from tests.normal_form_models import linear_charts

SENSORS = ("lower", "mid", "upper")
SHAPES = np.array([[1.0, -0.8], [1.0, 0.1], [1.0, 0.9]])
EIGENVALUES = np.array([-3.2 + 694.1j, -6.5 + 1250.0j])
DURATION = 0.6
STARTS = {"bending": (-0.6, 0.0), "torsion": (0.0, 0.45), "mixed": (-0.35, 0.3), "other": (-0.5, 0.15)}


def arch(modal_load: tuple[float, float]) -> ReducedModel:
    """eta_j'' + 2 abs(Re lambda_j) eta_j' + abs(lambda_j)^2 eta_j + dV/deta_j = modal_load_j u, eta in mm, exactly.

    V = w^2 (0.18 eta_1^3 + 0.0465 eta_1^4 + 0.15 eta_1^2 eta_2), w = abs(lambda_1): the cubic energy moves the mean by
    -0.27 A^2 and softens, as in the benchmark. With eta = z + conj z, eta' = lambda z + c.c. eliminating eta gives

        z_j' = lambda_j z_j + (modal_load_j u - dV/deta_j) / (lambda_j - conj lambda_j):

    all monomials, so that forced answers come from harmonic balance on these equations.
    """
    w2 = abs(EIGENVALUES[0]) ** 2
    force = ({(2, 0): 0.54 * w2, (1, 1): 0.3 * w2, (3, 0): 0.186 * w2}, {(2, 0): 0.15 * w2})
    rows: dict[tuple[int, ...], ComplexArray] = {}
    for j, terms in enumerate(force):
        for (p, q), c in terms.items():
            for i, k in np.ndindex(p + 1, q + 1):
                column = rows.setdefault((p - i, q - k, i, k), np.zeros(2, dtype=np.complex128))
                column[j] -= comb(p, i) * comb(q, k) * c / (2j * EIGENVALUES[j].imag)
    terms_of_z = PolynomialMap(np.array(list(rows)), np.array(list(rows.values())).T)
    load = np.array(modal_load) / (2j * EIGENVALUES.imag)
    model = linear_charts(EIGENVALUES, terms_of_z, load, (1, 2), np.array([0.7, 0.5]))
    maps: PolynomialMap[np.float64] = PolynomialMap(
        np.eye(4, dtype=np.int64), np.hstack([1e-3 * SHAPES, np.zeros((3, 2))])
    )
    inputs = {"inputs": ("base_acceleration",), "input_units": ("m/s2",)}
    return replace(model, displacement=maps, velocity=maps, sensors=SENSORS, **inputs)


def decays() -> list[Trajectory]:
    """Four free decays at 10 kHz, bending from 1.2 mm."""
    t, model = 1e-4 * np.arange(round(DURATION * 1e4) + 1), arch((0.0, 0.0))
    return [
        Trajectory(name, t, SENSORS, sensors(model, simulate(model, t, np.array(start, dtype=np.complex128)))[0])
        for name, start in STARTS.items()
    ]
