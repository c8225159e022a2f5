"""The finished reduced model: everything downstream reads only this record."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.polynomial import PolynomialMap
from romgen.stability import Stability
from romgen.trained_range import TrainedRange, box_range


@dataclass(frozen=True)
class ReducedModel:
    """An extended normal form on a spectral submanifold with its charts and sensor maps.

    With m master modes, z in C^m and zeta = (z_1..z_m, conj z_1..conj z_m) in C^2m:

        z' = Lambda z + N zeta^E + G u(t)             reduced dynamics
        y / s = Re(T zeta^E)                           chart, y = (eta_1..m, eta'_1..m) in R^2m
        z = H (y / s)^E                                inverse chart
        x = W (y / s)^E,  x' = W_v (y / s)^E           sensors

    Morsy, Xu, Tiso, Haller 2024, eqs. for w, v, t^-1, n and the forced normal form.

    Attributes
    ----------
    name : identifier (letters, digits, underscore).
    eigenvalues : (m,) 1/s, positive imaginary parts, ascending.
    normal_form : N, m complex rows over the 2m variables zeta, nonlinear terms only, 1/s.
    chart : T, 2m complex rows over zeta, linear terms included; the real part is taken.
    inverse_chart : H, m complex rows over the 2m real variables y / s, linear terms included.
    scale : (2m,) s, the unit of each y.
    displacement, velocity : W and W_v, one real row per sensor over y / s, m and m/s.
    sensors : names of the rows of the sensor maps.
    inputs : names of the load inputs, e.g. ("base_acceleration",).
    input_units : their SI units, e.g. ("m/s2",).
    input_matrix : G, (m, n_input) complex, 1/s per input unit.
    internal_resonance : integers r_j of the master modes, e.g. (1, 2); () without resonance.
    trained_amplitude : (m,) largest abs(z_j) over the training data.
    trained_facets : (n_facet, m) of ``trained_range``; None is the box abs(z_j) <= trained_amplitude_j.
    stability : free decays that were tried; None where none were.
    """

    name: str
    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    normal_form: PolynomialMap[np.complex128]
    chart: PolynomialMap[np.complex128]
    inverse_chart: PolynomialMap[np.complex128]
    scale: FloatArray = field(metadata={"unit": "mixed", "axes": "coordinate"})
    displacement: PolynomialMap[np.float64]
    velocity: PolynomialMap[np.float64]
    sensors: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    input_matrix: ComplexArray = field(metadata={"unit": "1/s per input unit", "axes": "mode,input"})
    internal_resonance: tuple[int, ...]
    trained_amplitude: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    trained_facets: FloatArray | None = field(default=None, metadata={"unit": "1", "axes": "facet,mode"})
    stability: Stability | None = None

    @property
    def trained_range(self) -> TrainedRange:
        """Amplitudes that the training motions passed through, with the distance measure of ``trust_ratio``."""
        return box_range(self.trained_amplitude) if self.trained_facets is None else TrainedRange(self.trained_facets)
