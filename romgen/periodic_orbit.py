"""Periodic orbits of the complete forced reduced model by harmonic balance, with Floquet multipliers.

Nothing is dropped here: all terms, both exponentials of the load, all modes. Cameron, Griffin 1989 (alternating
frequency/time); Blanes, Casas, Ros 2000 (Magnus integrator of order 4).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.polynomial import PolynomialMap, evaluate, jacobian, zeta
from romgen.reduced_model import ReducedModel
from romgen.rotating_frame import join, real_jacobian, rotations, split

# Magnus steps per forcing period, a power of two; doubling changes the multipliers of a hard Duffing orbit by 1e-6.
STEPS = 128
# Terms of the Taylor series of each step's exponential: its norm is below 0.5, so the remainder is below 0.5^15 / 15!.
TAYLOR = 14


@dataclass(frozen=True)
class HarmonicBalance:
    """z' = Lambda z + N zeta^E + f (e^{i Omega t} + e^{-i Omega t}) with z_j = sum_k c_kj exp(i k Omega t / r_f).

        F_kj = (lambda_j - i k Omega / r_f) c_kj + [N zeta^E]_kj + f_j (k = +-r_f),   k = -H..H

    Real state x = (Re c, Im c), harmonic-major. It satisfies ``romgen.branch.ParameterSystem`` with p = Omega in rad/s.

    Attributes
    ----------
    eigenvalues : (m,) 1/s.
    terms : all nonlinear terms, m rows over zeta, 1/s.
    rotation : (m,) integers r_j: harmonic r_j of mode j is its q_j.
    forced : r_f, the period is 2 pi r_f / Omega.
    load : (m,) f, 1/s.
    harmonics : H.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    terms: PolynomialMap[np.complex128]
    rotation: IntArray = field(metadata={"unit": "1", "axes": "mode"})
    forced: int
    load: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    harmonics: int

    @property
    def orders(self) -> IntArray:
        """The harmonics -H..H."""
        return np.arange(-self.harmonics, self.harmonics + 1)

    def linearise(self, x: FloatArray, p: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return F (n,), F_x (n, n) and F_p (n,), n = 2 m (2H + 1), at Omega = p rad/s."""
        c, n = self._coefficients(x), self._samples
        variables = zeta(self.orbits(x[None], np.array([p]), n)[0])
        terms = np.fft.fft(evaluate(self.terms, variables), axis=0)[self.orders] / n
        slopes = np.fft.fft(jacobian(self.terms, variables), axis=0) / n
        spin = 1j * self.orders[:, None] / self.forced
        F = (self.eigenvalues - spin * p) * c + terms
        F[np.abs(self.orders) == self.forced] += self.load
        m, k = self.eigenvalues.size, self.orders
        by_c = _blocks(slopes[k[:, None] - k[None, :], :, :m])
        by_conjugate = _blocks(slopes[k[:, None] + k[None, :], :, m:])
        by_c = by_c + np.diag((self.eigenvalues - spin * p).ravel())
        return split(F.ravel()), real_jacobian(by_c, by_conjugate), split(np.asarray((-spin * c).ravel()))

    def multipliers(self, x: FloatArray, p: float) -> ComplexArray:
        """Return the Floquet multipliers (2m,), eigenvalues of the monodromy matrix over T = 2 pi r_f / Omega."""
        return np.linalg.eigvals(self.monodromy(x, p)).astype(np.complex128)

    def monodromy(self, x: FloatArray, p: float, steps_per_period: int = STEPS) -> ComplexArray:
        """Return the monodromy matrix (2m, 2m) in (z, conj z) by the Magnus integrator of order 4.

        Phi <- exp(h/2 (A_1 + A_2) + sqrt(3)/12 h^2 [A_2, A_1]) Phi with A at the two Gauss nodes of each step.
        """
        steps = steps_per_period << (self.forced - 1).bit_length()
        h = 2.0 * np.pi * self.forced / p / steps
        nodes = (np.arange(steps)[:, None] + 0.5 + np.array([-1.0, 1.0]) * np.sqrt(3.0) / 6.0) / steps
        wave = np.exp(2j * np.pi * np.multiply.outer(nodes, self.orders))
        A = self._field_slope(wave.reshape(2 * steps, -1) @ self._coefficients(x))
        A_1, A_2 = A[0::2], A[1::2]
        exponent = 0.5 * h * (A_1 + A_2) + np.sqrt(3.0) / 12.0 * h**2 * (A_2 @ A_1 - A_1 @ A_2)
        return _product(_exponential(exponent))

    def orbits(self, x: FloatArray, omega: FloatArray, n_phase: int) -> ComplexArray:
        """Return z (n_point, n_phase, m) over one period of x (n_point, n_state); ``omega`` does not enter."""
        c = join(x).reshape(len(x), self.orders.size, -1)
        phase = 2.0 * np.pi * np.arange(n_phase) / n_phase
        return np.asarray(np.exp(1j * np.outer(phase, self.orders)) @ c)

    def shifted(self, x: FloatArray, periods: int) -> FloatArray:
        """Return the state (n,) of the same motion, ``periods`` forcing periods 2 pi / Omega later."""
        turn = np.exp(2j * np.pi * periods * self.orders[:, None] / self.forced)
        return split(np.asarray((self._coefficients(x) * turn).ravel()))

    def modal(self, x: FloatArray) -> ComplexArray:
        """Return q (n_point, m): the harmonic r_j of mode j, which the rotating frame keeps."""
        c = join(x).reshape(len(x), self.orders.size, -1)
        return np.asarray(c[:, self.harmonics + self.rotation, np.arange(self.rotation.size)])

    def state(self, z: ComplexArray) -> FloatArray:
        """Return the state x of one orbit z (n_phase, m), equispaced over the period."""
        return split(np.asarray(np.fft.fft(z, axis=0)[self.orders] / len(z)).ravel())

    def start(self, q: ComplexArray, omega: float) -> FloatArray:
        """Return the state with q_j in harmonic r_j of mode j and the load's other harmonics of the linear model."""
        c = np.zeros((self.orders.size, self.rotation.size), dtype=np.complex128)
        for k in (-self.forced, self.forced):
            c[self.harmonics + k] = self.load / (1j * k / self.forced * omega - self.eigenvalues)
        c[self.harmonics + self.rotation, np.arange(self.rotation.size)] = q
        return split(c.ravel())

    def linear_response(self, omega: float) -> ComplexArray:
        """Return q (m,) of the linear model: f_j / (i Omega - lambda_j) where r_j = r_f, else 0."""
        return np.where(self.rotation == self.forced, self.load / (1j * omega - self.eigenvalues), 0.0)

    @property
    def _samples(self) -> int:
        """Samples per period without aliasing: a term of degree d reaches harmonic d H and folds onto -H..H."""
        degree = int(self.terms.exponents.sum(axis=1).max(initial=1))
        return 1 << ((degree + 1) * self.harmonics).bit_length()

    def _coefficients(self, x: FloatArray) -> ComplexArray:
        return cast(ComplexArray, join(x).reshape(self.orders.size, -1))

    def _field_slope(self, z: ComplexArray) -> ComplexArray:
        """Return the derivative (n_time, 2m, 2m) of (z', conj z') by (z, conj z) at z (n_time, m)."""
        m = self.rotation.size
        slope = jacobian(self.terms, zeta(z))
        by_z, by_conjugate = slope[..., :m] + np.diag(self.eigenvalues), slope[..., m:]
        return np.asarray(np.block([[by_z, by_conjugate], [by_conjugate.conj(), by_z.conj()]]))


def harmonic_balance(model: ReducedModel, load: ComplexArray, forced_mode: int, harmonics: int = 9) -> HarmonicBalance:
    """Return the harmonic balance of a model under ``load`` near the resonance of one of its modes.

    Parameters
    ----------
    load : (m,) complex amplitude on exp(+i Omega t), 1/s (``romgen.forcing.harmonic_load``).
    forced_mode : index of the mode whose linear resonance the load is near.
    harmonics : H, per period 2 pi r_f / Omega.
    """
    r = rotations(model)
    return HarmonicBalance(model.eigenvalues, model.normal_form, r, int(r[forced_mode]), load, harmonics)


def _blocks(slopes: ComplexArray) -> ComplexArray:
    """Return the (K m, K m) matrix of the blocks (K, K, m, m)."""
    K, _, m, _ = slopes.shape
    return slopes.transpose(0, 2, 1, 3).reshape(K * m, K * m)


def _exponential(matrices: ComplexArray) -> ComplexArray:
    """Return exp of each matrix (n, k, k) of norm below 0.5 by its Taylor series."""
    identity = np.eye(matrices.shape[1])
    result = np.broadcast_to(identity, matrices.shape).astype(np.complex128)
    for k in range(TAYLOR, 0, -1):
        result = identity + matrices @ result / k
    return result


def _product(matrices: ComplexArray) -> ComplexArray:
    """Return matrices[-1] ... matrices[1] matrices[0] of a power of two matrices (n, k, k)."""
    while len(matrices) > 1:
        matrices = matrices[1::2] @ matrices[0::2]
    return np.asarray(matrices[0])
