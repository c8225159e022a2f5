"""Forced periodic orbits with the load as parameter, at a fixed frequency or in phase resonance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.forced_curve import ForcedSystem
from romgen.forced_response import LIMIT, forced_system
from romgen.lifted_orbit import SAMPLES, Measure, orbit_amplitudes
from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class MeasuredPoint:
    """A measured steady state, for one input.

    Attributes
    ----------
    name : how messages call it.
    level : amplitude of the cosine on the input, in its unit.
    frequency_hz : forcing frequency; of a peak what was measured, or None.
    peak : it is the peak of the response, which is taken as phase resonance at the frequency of the model.
    sensor : row of the sensor maps; measure, amplitude : what it showed, m.
    mode : index of the mode that is driven near resonance.
    """

    name: str
    level: float
    frequency_hz: float | None
    sensor: int
    measure: Measure
    amplitude: float
    mode: int
    peak: bool = False


@dataclass(frozen=True)
class LoadSystem:
    """F(x, Omega) + p F_l = 0 with one more condition, as ``romgen.branch.ParameterSystem`` of the load p.

    State (x, w), Omega = Omega_0 + w Omega_1. The condition is w = 0, or phase resonance of the driven mode,
    Im(conj(l_j) q_j) = 0: load and velocity in phase.

    Attributes
    ----------
    model : with ``column``, (m,) complex G of this input, 1/s per input unit.
    mode : index j of the driven mode.
    still : the system without load.
    push : (n,) F_l, the residual of a unit load at x = 0.
    phase : (n,) row of the phase condition; None keeps the frequency.
    omega, spread : Omega_0 and Omega_1, rad/s.
    """

    model: ReducedModel
    column: ComplexArray = field(metadata={"unit": "1/s per input unit", "axes": "mode"})
    mode: int
    still: ForcedSystem
    push: FloatArray = field(metadata={"unit": "1/s per input unit", "axes": "state"})
    phase: FloatArray | None = field(metadata={"unit": "1", "axes": "state"})
    omega: float
    spread: float

    def linearise(self, x: FloatArray, p: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the residual (n + 1,), its Jacobian by (x, w) and its derivative by the load p."""
        F, F_x, F_omega = self.still.linearise(x[:-1], self.frequency(x))
        row = np.append(np.zeros(F.size), 1.0) if self.phase is None else np.append(self.phase, 0.0)
        residual = np.append(F + p * self.push, row @ x)
        J = np.vstack([np.column_stack([F_x, self.spread * F_omega]), row])
        return residual, J, np.append(self.push, 0.0)

    def multipliers(self, x: FloatArray, p: float) -> ComplexArray:
        """Return the Floquet multipliers of the orbit; the load does not enter them but through x."""
        return self.still.multipliers(x[:-1], self.frequency(x))

    def frequency(self, x: FloatArray) -> float:
        """Return Omega in rad/s of a state (x, w)."""
        return self.omega + self.spread * float(x[-1])

    def loaded(self, p: float) -> ForcedSystem:
        """Return the system under p cos(Omega t): complex amplitude G p / 2."""
        return forced_system(self.model, np.asarray(0.5 * p * self.column), self.mode)

    def amplitudes(self, states: FloatArray, p: float, point: MeasuredPoint) -> FloatArray:
        """Return the amplitude (n_state,) in m at the sensor and in the measure of a point, all under the load p."""
        system = self.loaded(p)
        omega = self.omega + self.spread * states[:, -1]
        orbits = orbit_amplitudes(self.model, system.orbits(states[:, :-1], omega, SAMPLES * system.forced))
        chosen = orbits.max if point.measure == "max" else orbits.sqrt2_rms
        return np.asarray(chosen[:, point.sensor])


def load_system(model: ReducedModel, column: ComplexArray, point: MeasuredPoint) -> LoadSystem:
    """Return the system of one point: the frequency kept, or the phase of its driven mode.

    Parameters
    ----------
    column : (m,) G of the input, 1/s per input unit.

    Raises
    ------
    InputError : a point that is no peak has no frequency.
    """
    eigenvalue = model.eigenvalues[point.mode]
    if point.frequency_hz is None and not point.peak:
        raise InputError("a point that is no peak needs a frequency", where=point.name)
    omega = float(eigenvalue.imag) if point.peak else 2.0 * np.pi * float(point.frequency_hz or 0.0)
    unit = 0.5 * column
    still = forced_system(model, np.zeros_like(unit), point.mode)
    rest = still.start(np.zeros_like(unit), omega)
    push = forced_system(model, unit, point.mode).linearise(rest, omega)[0]
    phase: FloatArray | None = None
    if point.peak:
        direction = unit[point.mode].conjugate() / abs(unit[point.mode])
        phase = np.asarray((direction * still.modal(np.eye(rest.size))[:, point.mode]).imag)
    # w counts as a state: the branch ends where the resonance has moved by its whole frequency
    spread = omega / (LIMIT * float(np.max(model.trained_amplitude)))
    return LoadSystem(model, column, point.mode, still, push, phase, omega, spread)
