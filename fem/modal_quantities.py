"""What engineers read off a set of modes: comparison, participation, effective mass, near-integer ratios."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd

import numpy as np

from fem.arrays import ComplexArray, FloatArray
from fem.errors import FemInputError
from fem.finite_values import check_rows, finite_array
from fem.model import Model
from fem.modes import ModalBasis, Rayleigh, damping_ratios


@dataclass(frozen=True)
class NearRatio:
    """Two modes (from 0) with f_second / f_first = (high / low)(1 + detuning)."""

    first: int
    second: int
    low: int
    high: int
    detuning: float


def mac(a: FloatArray, b: FloatArray) -> FloatArray:
    """Modal assurance criterion (a_i'b_j)^2 / (a_i'a_i b_j'b_j) of two sets of shapes, (n_a, n_b) in [0, 1].

    a (n_row, n_a) and b (n_row, n_b) may be full shapes or their values at sensors.

    Sets with other numbers of rows raise ``FemInputError``.

    Source: Allemang & Brown, Proc. 1st IMAC (1982) 110-116.
    """
    shapes = (np.shape(a), np.shape(b))
    if len(shapes[0]) != 2 or len(shapes[1]) != 2 or shapes[0][0] != shapes[1][0]:
        advice = "give (n_row, n_a) and (n_row, n_b)"
        raise FemInputError("the sets of shapes do not fit together", where="mac", value=shapes, advice=advice)
    cross = a.T @ b
    return np.asarray(cross**2 / np.outer(np.einsum("na,na->a", a, a), np.einsum("nb,nb->b", b, b)))


def participation_factors(model: Model, modes: ModalBasis) -> FloatArray:
    """Gamma_jd = phi_j' M b_d for translations along x, y, z and rotations about the same axes, (n_mode, 6).

    b_4 to b_6 turn about the centre of mass. Units kg^0.5 and kg^0.5 m, since the modal masses are 1.
    """
    return np.asarray(modes.shapes.T @ (model.mass @ _rigid(model)))


def effective_masses(model: Model, modes: ModalBasis) -> FloatArray:
    """Gamma^2: the share of the mass in kg, and of the inertia in kg m^2, that moves with each mode, (n_mode, 6).

    Over all modes the shares add up to the mass less what the supports carry directly.
    """
    return participation_factors(model, modes) ** 2


def total_masses(model: Model) -> FloatArray:
    """Mass in kg (three times) and moments of inertia about the centre of mass in kg m^2, (6,)."""
    motion = _rigid(model)
    return np.asarray(np.einsum("nd,nd->d", motion, model.mass @ motion))


def near_integer_ratios(frequencies: FloatArray, *, tolerance: float = 0.1, highest: int = 3) -> tuple[NearRatio, ...]:
    """Pairs of modes with frequencies within ``tolerance`` of low:high, coprime, high <= ``highest``; closest first.

    Such modes can exchange energy at large amplitude: candidates for an internal resonance.
    """
    found = []
    for first in range(len(frequencies)):
        for second in range(first + 1, len(frequencies)):
            for high in range(1, highest + 1):
                for low in (k for k in range(1, high + 1) if gcd(k, high) == 1 and frequencies[first] > 0.0):
                    detuning = float(frequencies[second] / frequencies[first] * low / high - 1.0)
                    if abs(detuning) <= tolerance:
                        found.append(NearRatio(first, second, low, high, detuning))
    return tuple(sorted(found, key=lambda pair: abs(pair.detuning)))


def _rigid(model: Model) -> FloatArray:
    """Three translations and three rotations of the whole structure, (n_dof, 6)."""
    weight = model.mass @ model.direction("x")
    centre = weight[::3] @ model.points / weight[::3].sum()
    motion = np.zeros((len(model.points), 3, 6))
    motion[:, :, :3] = np.eye(3)
    motion[:, :, 3:] = np.cross(np.eye(3)[None], (model.points - centre)[:, None, :]).transpose(0, 2, 1)
    return motion.reshape(model.n_dof, 6)


def frequency_response(
    modes: ModalBasis, damping: Rayleigh, load: FloatArray, sensors: FloatArray, frequency_hz: FloatArray
) -> ComplexArray:
    """H(Omega) = sum_j (S phi_j)(phi_j' p) / (omega_j^2 - Omega^2 + 2 i zeta_j omega_j Omega), (n_frequency, n_sensor).

    The linear answer in m to a load p cos(Omega t), closed points stuck, by the given modes only: what the higher ones
    would add is their static answer, about (Omega / omega)^2 of which is left out.

    Parameters
    ----------
    load : (n_dof,) N, such as ``TimeLoad.pattern``; sensors : (n_sensor, n_dof) rows of ``sensor_rows``.
    frequency_hz : (n_frequency,).

    Other shapes and numbers that are not finite raise ``FemInputError``.
    """
    where, n_dof = "frequency response", len(modes.shapes)
    force = finite_array(load, (n_dof,), "the load", where=where, advice=f"give {n_dof} nodal forces")
    rows = check_rows(sensors, n_dof, where=where)
    advice = "give a list of frequencies"
    given = finite_array(frequency_hz, (-1,), "the list of frequencies", where=where, advice=advice)
    Omega = 2.0 * np.pi * given[:, None]
    zeta = damping_ratios(modes, damping)
    modal = (modes.shapes.T @ force) / (modes.omega**2 - Omega**2 + 2.0j * zeta * modes.omega * Omega)
    return np.asarray(modal @ (rows @ modes.shapes).T)
