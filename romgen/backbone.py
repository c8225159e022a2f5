"""Amplitude-dependent frequency and damping of one mode from the autonomous normal form.

Morsy, Xu, Tiso, Haller 2024, eq. (NF_damping1st) and Appendix A1; Breunung, Haller 2018.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import root

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.errors import InputError
from romgen.lifted_orbit import SAMPLES, orbit_amplitudes
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.rotating_frame import join, point_terms, real_jacobian, resonant_terms, rotations, split

POINTS = 100


@dataclass(frozen=True)
class Backbone:
    """Frequency and damping of one mode against its amplitude.

    Attributes
    ----------
    mode : index of the mode.
    slaved : whether the other modes are phase-locked to it (rho' = psi' = 0) or zero.
    rho : (n,) abs(z_mode).
    q : (n, m) all modes, with q_mode = rho real.
    frequency_hz : (n,) theta' / 2 pi.
    damping_ratio : (n,) -Re(z'/z) / theta'.
    sensors : names of the columns of the amplitudes.
    amplitude_max, amplitude_sqrt2_rms, mean : (n, n_sensor) over one period, m (``romgen.lifted_orbit``).
    exceeds_trained_range : (n,) outside the trained range (``romgen.trained_range``).
    notes : what was dropped or not reached.
    """

    mode: int
    slaved: bool
    rho: FloatArray = field(metadata={"unit": "1", "axes": "point"})
    q: ComplexArray = field(metadata={"unit": "1", "axes": "point,mode"})
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "point"})
    sensors: tuple[str, ...]
    amplitude_max: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    amplitude_sqrt2_rms: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    mean: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    exceeds_trained_range: BoolArray = field(metadata={"unit": "1", "axes": "point"})
    notes: tuple[str, ...]


def backbone(model: ReducedModel, mode: int = 0, slaved: bool = False, rho: FloatArray | None = None) -> Backbone:
    """Return the backbone of one mode, the other modes zero or slaved to it.

    With z_mode = rho e^{i theta} and z_k = q_k e^{i r_k theta / r_mode}:

        theta' = Im(n_mode / rho),   zeta = -Re(n_mode / rho) / theta',   slaved: n_k = i (r_k / r_mode) theta' q_k

    Parameters
    ----------
    mode : index of the mode.
    slaved : solve for the phase-locked other modes instead of setting them to zero.
    rho : (n,) ascending amplitudes abs(z_mode) > 0; by default up to the trained amplitude.

    Raises
    ------
    InputError : no such mode, an amplitude that is not positive, or rotations that cannot lock.

    Source: Morsy et al. 2024, Appendix A1 (instantaneous modal damping in polar coordinates).
    """
    m = model.eigenvalues.size
    if not 0 <= mode < m:
        raise InputError("no such mode", where=f"backbone of {model.name}", value=mode, advice=f"choose 0..{m - 1}")
    if rho is None:
        rho = model.trained_amplitude[mode] * np.arange(1, POINTS + 1) / POINTS
    if rho.size == 0 or rho[0] <= 0.0 or np.any(np.diff(rho) <= 0.0):
        raise InputError("amplitudes must be positive and ascending", where=f"backbone of {model.name}", value=rho)
    q, rate = normal_motion(model, mode, slaved, rho)
    notes = _notes(model)
    if len(q) < rho.size:
        notes += (f"no phase-locked motion was found at rho = {rho[len(q)]:.4g} and above",)
    return _record(model, q, rate, slaved, (mode, notes))


def normal_motion(model: ReducedModel, mode: int, slaved: bool, rho: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return all modes q (n, m) of the backbone at ascending amplitudes rho, and rho'/rho + i theta' (n,) in 1/s.

    Fewer rows than rho where the phase-locked motion ends.

    Raises
    ------
    InputError : rotations that cannot lock.
    """
    terms = _terms(model)
    q = np.zeros((rho.size, model.eigenvalues.size), dtype=np.complex128)
    q[:, mode] = rho
    if slaved:
        q = q[: _slave(_Locking(model.eigenvalues, terms, _locked_rotation(model, mode), mode), q)]
    values = np.array([point_terms(terms, row)[0][mode] for row in q], dtype=np.complex128)
    return q, np.asarray(model.eigenvalues[mode] + values / q[:, mode])


@dataclass(frozen=True)
class _Locking:
    """The condition n_k = i ratio_k theta' q_k for all modes k but one."""

    eigenvalues: ComplexArray
    terms: PolynomialMap[np.complex128]
    ratio: FloatArray
    mode: int

    def residual(self, x: FloatArray, rho: float) -> tuple[FloatArray, FloatArray]:
        """Return the residual (2(m-1),) and its Jacobian at x = (Re q_k, Im q_k), k != mode."""
        others = np.arange(self.eigenvalues.size) != self.mode
        q = np.full(others.size, rho, dtype=np.complex128)
        q[others] = join(x)
        value, slope = point_terms(self.terms, q)
        n = self.eigenvalues * q + value
        rate = n[self.mode].imag / rho
        m = others.size
        by_q, by_conjugate = slope[:, :m] + np.diag(self.eigenvalues), slope[:, m:]
        J = real_jacobian(by_q[:, others], by_conjugate[:, others])
        rows = np.concatenate([others, others])
        spin = 1j * self.ratio[others]
        turn = real_jacobian(np.diag(spin * rate), np.zeros((m - 1, m - 1), dtype=np.complex128))
        drift = np.outer(split(np.asarray(spin * q[others])), J[m + self.mode] / rho)
        return split(np.asarray(n[others] - spin * rate * q[others])), J[rows] - turn - drift


def _slave(locking: _Locking, q: ComplexArray) -> int:
    """Fill the slaved modes of q (n, m) row by row in place; return the number of rows solved."""
    others = np.arange(q.shape[1]) != locking.mode
    start = np.zeros(2 * (q.shape[1] - 1))
    for i, rho in enumerate(q[:, locking.mode].real):
        solution = root(locking.residual, start, args=(rho,), jac=True, method="hybr", options={"xtol": 1e-13})
        residual = np.max(np.abs(solution.fun), initial=0.0)
        if residual > 1e-9 * abs(locking.eigenvalues[locking.mode]) * rho:
            return i
        q[i, others] = join(solution.x)
        start = solution.x
    return len(q)


def _locked_rotation(model: ReducedModel, mode: int) -> FloatArray:
    """Return r_k / r_mode (m,), integers, or raise where a mode cannot lock."""
    r: IntArray = rotations(model)
    if np.any(r % r[mode]):
        raise InputError(
            "the other modes cannot lock to this one",
            where=f"backbone of {model.name}",
            value=f"mode {mode} with internal resonance {tuple(r.tolist())}",
            advice="ask for slaved=False",
        )
    return np.asarray(r / r[mode])


def _terms(model: ReducedModel) -> PolynomialMap[np.complex128]:
    """Return the resonant terms; the others average out over a period."""
    kept = resonant_terms(model.normal_form.exponents, rotations(model))
    return PolynomialMap(model.normal_form.exponents, np.where(kept, model.normal_form.coefficients, 0.0))


def _notes(model: ReducedModel) -> tuple[str, ...]:
    """Say how many terms are not resonant."""
    dropped = np.count_nonzero(model.normal_form.coefficients) - np.count_nonzero(_terms(model).coefficients)
    return (f"{dropped} non-resonant terms of the normal form do not enter the backbone",) if dropped else ()


def _record(
    model: ReducedModel, q: ComplexArray, rate: ComplexArray, slaved: bool, of: tuple[int, tuple[str, ...]]
) -> Backbone:
    """Evaluate frequency, damping and amplitudes along q (n, m); ``of`` is the mode and the notes."""
    mode, notes = of
    r = rotations(model)
    ratio = r / r[mode] if slaved else np.ones(r.size)
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    amplitudes = orbit_amplitudes(model, q[:, None, :] * np.exp(1j * np.outer(phase, ratio)))
    return Backbone(
        mode=mode,
        slaved=slaved,
        rho=np.abs(q[:, mode]),
        q=q,
        frequency_hz=rate.imag / (2.0 * np.pi),
        damping_ratio=-rate.real / rate.imag,
        sensors=model.sensors,
        amplitude_max=amplitudes.max,
        amplitude_sqrt2_rms=amplitudes.sqrt2_rms,
        mean=amplitudes.mean,
        exceeds_trained_range=model.trained_range.exceeded(q),
        notes=notes,
    )
