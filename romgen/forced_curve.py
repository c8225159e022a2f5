"""Records of the forced response, and one of them from a solution branch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.branch import Branch, End, ParameterSystem
from romgen.lifted_orbit import SAMPLES, Measure, OrbitAmplitudes, orbit_amplitudes
from romgen.reduced_model import ReducedModel

Route = Literal["rotating_frame", "periodic_orbit"]


class ForcedSystem(ParameterSystem, Protocol):
    """A parameter system (p = Omega, rad/s) whose solutions are forced periodic orbits of a reduced model."""

    @property
    def load(self) -> ComplexArray:
        """Return f (m,) on exp(+i Omega t), 1/s."""

    @property
    def forced(self) -> int:
        """Return r_f: the period is 2 pi r_f / Omega."""

    def linear_response(self, omega: float) -> ComplexArray:
        """Return q (m,) of the linear model."""

    def start(self, q: ComplexArray, omega: float) -> FloatArray:
        """Return a state that has modal amplitudes q (m,)."""

    def modal(self, x: FloatArray) -> ComplexArray:
        """Return the modal amplitudes q (n_point, m)."""

    def shifted(self, x: FloatArray, periods: int) -> FloatArray:
        """Return the state of the same motion, whole forcing periods later."""

    def orbits(self, x: FloatArray, omega: FloatArray, n_phase: int) -> ComplexArray:
        """Return z (n_point, n_phase, m) over one period."""


@dataclass(frozen=True)
class ForcedCurve:
    """One branch of the frequency response at one level, ordered along the branch.

    Attributes
    ----------
    input, level, unit : load level cos(2 pi f t) on that input.
    branch : 0 the branch that reaches the end of the range, 1.. further ones (detached, or beyond a limit).
    frequency_hz : (n,) forcing frequency.
    q : (n, m) complex modal amplitudes at the frequencies r_j f / r_f.
    stable : (n,) all Floquet multipliers inside the unit circle.
    amplitude_max, amplitude_sqrt2_rms, mean : (n, n_sensor) over one period, mean not removed, m.
    damping_ratio : (n,) instantaneous damping of the forced mode, Re(f / q) / Omega = -Re(n / q) / Omega.
    exceeds_trained_range : (n,) q lies outside the trained range (``romgen.trained_range``).
    folds_hz, fold_index : located folds and their rows.
    hopf_hz : located torus (Neimark-Sacker) points, Hopf points of the rotating frame.
    period_doubling_hz, branch_point_hz : located period doublings and branch points.
    peak_hz, peak_m : largest amplitude of the chosen sensor and measure, by a parabola along the branch.
    phase_resonance_hz, phase_resonance_m : points with Im(conj(f) q) = 0, load and velocity in phase; same reading.
    ends : why the branch ends at its first and last row.
    """

    input: str
    level: float
    unit: str
    branch: int
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    q: ComplexArray = field(metadata={"unit": "1", "axes": "point,mode"})
    stable: BoolArray = field(metadata={"unit": "1", "axes": "point"})
    amplitude_max: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    amplitude_sqrt2_rms: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    mean: FloatArray = field(metadata={"unit": "m", "axes": "point,sensor"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "point"})
    exceeds_trained_range: BoolArray = field(metadata={"unit": "1", "axes": "point"})
    folds_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "fold"})
    fold_index: IntArray = field(metadata={"unit": "1", "axes": "fold"})
    hopf_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    period_doubling_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    branch_point_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    peak_hz: float
    peak_m: float
    phase_resonance_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point"})
    phase_resonance_m: FloatArray = field(metadata={"unit": "m", "axes": "point"})
    ends: tuple[End, End]


@dataclass(frozen=True)
class ForcedResponse:
    """Frequency response curves of a reduced model.

    Attributes
    ----------
    curves : level by level, the main branch first.
    route : "rotating_frame", or "periodic_orbit" (harmonic balance) where some terms are not resonant.
    sensors : names of the columns of the amplitudes.
    sensor, measure : what peaks and phase resonances are read from.
    frequency_range_hz : the range that was followed.
    notes : every choice and omission a reader has to know.
    wall_s : wall time of all curves, s.
    """

    curves: tuple[ForcedCurve, ...]
    route: Route
    sensors: tuple[str, ...]
    sensor: str
    measure: Measure
    frequency_range_hz: tuple[float, float]
    notes: tuple[str, ...]
    wall_s: float


@dataclass(frozen=True)
class Observation:
    """The load of a curve and where its peak is read.

    Attributes
    ----------
    input, unit, level : the load.
    forced_mode : the mode it drives near resonance.
    sensor : column of the amplitudes.
    measure : which amplitude.
    """

    input: str
    unit: str
    level: float
    forced_mode: int
    sensor: int
    measure: Measure

    def read(self, amplitudes: OrbitAmplitudes) -> FloatArray:
        """Return the amplitude (n,) of the chosen sensor and measure."""
        chosen = amplitudes.max if self.measure == "max" else amplitudes.sqrt2_rms
        return np.asarray(chosen[:, self.sensor])


def forced_curve(
    model: ReducedModel, system: ForcedSystem, branch: Branch, number: int, observed: Observation
) -> ForcedCurve:
    """Return the curve of a solution branch: amplitudes of the lifted orbits, special points, peak.

    Parameters
    ----------
    branch : states x and parameter Omega (rad/s) of ``system``.
    number : its number among the branches of this level.
    """
    q = system.modal(branch.x)
    amplitudes = orbit_amplitudes(model, system.orbits(branch.x, branch.p, SAMPLES * system.forced))
    answer, hz = observed.read(amplitudes), branch.p / (2.0 * np.pi)
    load, q_forced = system.load[observed.forced_mode], q[:, observed.forced_mode]
    peak_hz, peak_m = _peak(hz, answer)
    resonance = _crossings((load.conjugate() * q_forced).imag, (load.conjugate() * q_forced).real > 0.0)
    return ForcedCurve(
        input=observed.input,
        level=observed.level,
        unit=observed.unit,
        branch=number,
        frequency_hz=hz,
        q=q,
        stable=branch.stable,
        amplitude_max=amplitudes.max,
        amplitude_sqrt2_rms=amplitudes.sqrt2_rms,
        mean=amplitudes.mean,
        damping_ratio=_damping(load, q_forced, branch.p),
        exceeds_trained_range=model.trained_range.exceeded(q),
        folds_hz=_hz(branch, "fold"),
        fold_index=np.array([point.index for point in branch.located("fold")], dtype=np.int64),
        hopf_hz=_hz(branch, "torus"),
        period_doubling_hz=_hz(branch, "period_doubling"),
        branch_point_hz=_hz(branch, "branch_point"),
        peak_hz=peak_hz,
        peak_m=peak_m,
        phase_resonance_hz=np.interp(resonance, np.arange(hz.size), hz),
        phase_resonance_m=np.interp(resonance, np.arange(hz.size), answer),
        ends=branch.ends,
    )


def _hz(branch: Branch, kind: Literal["fold", "torus", "period_doubling", "branch_point"]) -> FloatArray:
    return np.array([point.p for point in branch.located(kind)], dtype=np.float64) / (2.0 * np.pi)


def _damping(load: complex, q: ComplexArray, omega: FloatArray) -> FloatArray:
    """Return Re(f / q) / Omega: on a periodic orbit n / q = i Omega - f / q, so this is -Re(n / q) / Omega."""
    share = np.divide(load, q, out=np.full_like(q, np.nan), where=q != 0.0)
    return np.asarray(share.real / omega)


def _crossings(values: FloatArray, wanted: BoolArray) -> FloatArray:
    """Return the fractional rows where ``values`` changes sign between two wanted rows."""
    rows = np.flatnonzero((values[:-1] * values[1:] < 0.0) & wanted[:-1] & wanted[1:])
    return np.asarray(rows + values[rows] / (values[rows] - values[rows + 1]), dtype=np.float64)


def _peak(hz: FloatArray, amplitude: FloatArray) -> tuple[float, float]:
    """Return frequency and amplitude of the maximum, by parabolas in arclength through its three highest rows."""
    top = int(np.argmax(amplitude))
    if not 0 < top < hz.size - 1:
        return float(hz[top]), float(amplitude[top])
    rows = slice(top - 1, top + 2)
    span = float(np.ptp(hz)) or 1.0
    chord = np.hypot(np.diff(hz[rows]) / span, np.diff(amplitude[rows]) / amplitude[top])
    if np.min(chord) <= 0.0:
        return float(hz[top]), float(amplitude[top])
    s = np.array([-chord[0], 0.0, chord[1]])
    a, b, _ = np.polyfit(s, amplitude[rows], 2)
    summit = -b / (2.0 * a) if a < 0.0 else 0.0
    frequency = np.polyval(np.polyfit(s, hz[rows], 2), summit)
    return float(frequency), float(np.polyval(np.polyfit(s, amplitude[rows], 2), summit))
