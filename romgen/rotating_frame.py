"""Periodic orbits of the forced normal form as equilibria in rotating coordinates.

Morsy, Xu, Tiso, Haller 2024; Jain, Haller 2022 (forced response from spectral submanifolds with internal resonance).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.errors import InputError
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class RotatingFrame:
    """The autonomous field of q, z_j = q_j exp(i r_j Omega t / r_f), with only resonant terms and loads.

        q_j' = (lambda_j - i r_j Omega / r_f) q_j + sum_k N_jk (q, conj q)^E_k + f_j
        kept terms: sum_i (E_ki - E_k,m+i) r_i = r_j;   kept loads: rows with r_j = r_f

    Real state x = (Re q, Im q). It satisfies ``romgen.branch.ParameterSystem`` with p = Omega in rad/s.

    Attributes
    ----------
    eigenvalues : (m,) 1/s.
    terms : the kept terms, m rows over (q, conj q), 1/s.
    rotation : (m,) integers r_j.
    forced : r_f, the integer of the rows that the load drives resonantly.
    load : (m,) f on exp(+i Omega t), 1/s, zero in the rows that it does not drive resonantly.
    dropped_terms : (m,) largest sum of dropped terms at the trained amplitude over abs(lambda_j) trained_j.
    dropped_load : (m,) load left to the first-order correction, 1/s.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    terms: PolynomialMap[np.complex128]
    rotation: IntArray = field(metadata={"unit": "1", "axes": "mode"})
    forced: int
    load: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    dropped_terms: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    dropped_load: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})

    def linearise(self, x: FloatArray, p: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return F (2m,), F_x (2m, 2m) and F_p (2m,) at x = (Re q, Im q) and Omega = p rad/s."""
        m = self.eigenvalues.size
        q = x[:m] + 1j * x[m:]
        spin = 1j * self.rotation / self.forced
        value, slope = point_terms(self.terms, q)
        F = np.asarray((self.eigenvalues - spin * p) * q + value + self.load, dtype=np.complex128)
        by_q = np.diag(self.eigenvalues - spin * p) + slope[:, :m]
        F_p = np.asarray(-spin * q, dtype=np.complex128)
        return split(F), real_jacobian(by_q, slope[:, m:]), split(F_p)

    def multipliers(self, x: FloatArray, p: float) -> ComplexArray:
        """Return exp(eigenvalue T) of F_x, the Floquet multipliers of the orbit of period T = 2 pi r_f / Omega."""
        eigenvalues = np.linalg.eigvals(self.linearise(x, p)[1]).astype(np.complex128)
        return np.exp(eigenvalues * (2.0 * np.pi * self.forced / p))

    def linear_response(self, omega: float) -> ComplexArray:
        """Return q (m,) of the linear model, f_j / (i Omega - lambda_j) in the driven rows."""
        return np.asarray(self.load / (1j * omega - self.eigenvalues))

    def start(self, q: ComplexArray, omega: float) -> FloatArray:
        """Return the state x of q (m,); ``omega`` does not enter."""
        return split(q)

    def modal(self, x: FloatArray) -> ComplexArray:
        """Return q (n_point, m) of x (n_point, 2m)."""
        return join(x)

    def shifted(self, x: FloatArray, periods: int) -> FloatArray:
        """Return the state (2m,) of the same motion, ``periods`` forcing periods 2 pi / Omega later."""
        return split(np.asarray(join(x) * np.exp(2j * np.pi * periods * self.rotation / self.forced)))

    def orbits(self, x: FloatArray, omega: FloatArray, n_phase: int) -> ComplexArray:
        """Return z over one period 2 pi r_f / Omega, with the non-resonant load to first order.

            z_j = q_j e^{i r_j phi} + [r_j != r_f] f_j / (i Omega - lambda_j) e^{i r_f phi}
                  + f_j / (-i Omega - lambda_j) e^{-i r_f phi},   phi = Omega t / r_f

        Parameters
        ----------
        x : (n_point, 2m); omega : (n_point,) rad/s.

        Returns
        -------
        (n_point, n_phase, m)

        Source: Breunung, Haller 2018 (first-order non-autonomous correction).
        """
        phase = 2.0 * np.pi * np.arange(n_phase) / n_phase
        forward = self.dropped_load / (1j * omega[:, None] - self.eigenvalues)
        backward = (self.load + self.dropped_load) / (-1j * omega[:, None] - self.eigenvalues)
        drive = np.exp(1j * self.forced * phase)[None, :, None]
        z = join(x)[:, None, :] * np.exp(1j * np.outer(phase, self.rotation))
        return np.asarray(z + forward[:, None, :] * drive + backward[:, None, :] * drive.conj())


def rotating_frame(model: ReducedModel, load: ComplexArray, forced_mode: int) -> RotatingFrame:
    """Return the rotating frame of a model under ``load`` near the resonance of one of its modes.

    Parameters
    ----------
    load : (m,) complex amplitude on exp(+i Omega t), 1/s (``romgen.forcing.harmonic_load``).
    forced_mode : index of the mode whose linear resonance the load is near; r_f is its rotation.

    Source: Morsy et al. 2024; rows and terms are kept by exact integer resonance.
    """
    rotation = rotations(model)
    forced = int(rotation[forced_mode])
    kept = resonant_terms(model.normal_form.exponents, rotation)
    used = np.any(kept & (model.normal_form.coefficients != 0.0), axis=0)
    coefficients = np.where(kept, model.normal_form.coefficients, 0.0)[:, used]
    return RotatingFrame(
        eigenvalues=model.eigenvalues,
        terms=PolynomialMap(model.normal_form.exponents[used], coefficients),
        rotation=rotation,
        forced=forced,
        load=np.where(rotation == forced, load, 0.0),
        dropped_terms=_dropped_share(model, kept),
        dropped_load=np.where(rotation == forced, 0.0, load),
    )


def rotations(model: ReducedModel) -> IntArray:
    """Return the integers r_j (m,): the internal resonance, or all ones without one.

    Raises
    ------
    InputError : their number is not the number of modes, or one is not positive.
    """
    r = np.array(model.internal_resonance or (1,) * model.eigenvalues.size, dtype=np.int64)
    if r.size != model.eigenvalues.size or np.any(r < 1):
        raise InputError(
            "the internal resonance needs one positive integer per master mode",
            where=f"model {model.name}",
            value=model.internal_resonance,
        )
    return r


def resonant_terms(exponents: IntArray, rotation: IntArray) -> BoolArray:
    """Return (m, n_term): whether term k turns with r_j, sum_i (E_ki - E_k,m+i) r_i = r_j."""
    m = rotation.size
    turns = (exponents[:, :m] - exponents[:, m:]) @ rotation
    return np.asarray(turns[None, :] == rotation[:, None])


def point_terms(terms: PolynomialMap[np.complex128], q: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the value (m,) of a polynomial over (q, conj q) at one point and its derivatives (m, 2m).

    q and conj q count as independent. All monomials come from one table of powers: this is the inner loop of
    continuation, where the time-first evaluation of ``romgen.polynomial`` would spend its time in set-up.
    """
    E = terms.exponents
    variables = np.concatenate([q, q.conj()])
    n_var = variables.size
    powers = np.ones((n_var, int(E.max(initial=0)) + 1), dtype=np.complex128)
    powers[:, 1:] = np.cumprod(np.repeat(variables[:, None], powers.shape[1] - 1, axis=1), axis=1)
    factors = powers[np.arange(n_var), E]
    lowered = E * powers[np.arange(n_var), np.maximum(E - 1, 0)]
    # with the variable's own factor replaced by its derivative: (n_term, n_var, n_var)
    own = np.eye(n_var, dtype=bool)
    gradient = np.prod(np.where(own, lowered[:, None, :], factors[:, None, :]), axis=2)
    return terms.coefficients @ np.prod(factors, axis=1), terms.coefficients @ gradient


def split(q: ComplexArray) -> FloatArray:
    """Return (Re q, Im q), (2m,), of q (m,)."""
    return np.concatenate([q.real, q.imag])


def join(x: FloatArray) -> ComplexArray:
    """Return q (..., m) of x = (Re q, Im q) (..., 2m)."""
    m = x.shape[-1] // 2
    return np.asarray(x[..., :m] + 1j * x[..., m:])


def real_jacobian(by_q: ComplexArray, by_conjugate: ComplexArray) -> FloatArray:
    """Return the real Jacobian (2m, 2n) by (Re q, Im q) of dF = by_q dq + by_conjugate conj(dq), both (m, n)."""
    m, n = by_q.shape
    plus, minus = by_q + by_conjugate, by_q - by_conjugate
    J = np.empty((2 * m, 2 * n))
    J[:m, :n], J[:m, n:], J[m:, :n], J[m:, n:] = plus.real, -minus.imag, plus.imag, minus.real
    return J


def _dropped_share(model: ReducedModel, kept: BoolArray) -> FloatArray:
    """Return (m,) the sum of the dropped terms at the trained amplitude over abs(lambda_j) trained_j."""
    rho = model.trained_amplitude
    size = np.prod(np.concatenate([rho, rho]) ** model.normal_form.exponents, axis=1)
    dropped = np.where(kept, 0.0, np.abs(model.normal_form.coefficients)) @ size
    return np.asarray(dropped / np.maximum(np.abs(model.eigenvalues) * rho, np.finfo(np.float64).tiny))
