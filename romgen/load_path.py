"""Forced periodic orbits along a growing load, and the load at which one sensor shows a measured amplitude.

Near a fold the amplitude is multivalued in the load at a fixed frequency, but along the branch from rest the load is a
function of the amplitude: every measured amplitude belongs to one load, also on steep and on unstable parts.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.branch import Branch, ContinuationSettings
from romgen.continuation import continue_branch, solve_at
from romgen.errors import InputError, NumericalError
from romgen.forced_curve import ForcedSystem
from romgen.forced_response import LIMIT, forced_system
from romgen.lifted_orbit import SAMPLES, Measure, orbit_amplitudes
from romgen.reduced_model import ReducedModel

# A resonance is followed from this share of what the linear model needs (of the trained amplitude at most).
FIRST_SHARE = 0.1
# The branch is followed to this multiple of the modal amplitude that the linear model has at the measured one.
AHEAD = 2.0
# Modal amplitude, over the trained one, at which the linear amplitude of a sensor is read.
SMALL = 1e-3
# A sensor whose linear amplitude is below this share of the largest one does not see the mode.
SEEN = 1e-3
# Central differences of the amplitude: truncation and rounding are both near 1e-10.
DIFFERENCE = 1e-5
NEWTON_STEPS, NEWTON_TOLERANCE = 30, 1e-10


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


@dataclass(frozen=True)
class LoadAtAmplitude:
    """The load at which the model shows the amplitude of a point.

    Attributes
    ----------
    level : load, in the unit of the input.
    frequency_hz : of the solution.
    q : (m,) modal amplitudes.
    by_amplitude, by_frequency : d ln level / d ln amplitude and d ln level / d ln frequency (0 at a resonance).
    stable : whether a sweep would stay there.
    crossings : how often the branch passes this amplitude; the first one from rest is taken.
    """

    level: float
    frequency_hz: float
    q: ComplexArray
    by_amplitude: float
    by_frequency: float
    stable: bool
    crossings: int


@dataclass(frozen=True)
class LoadPath:
    """The branch from rest along a growing load, with the amplitude of one point's sensor."""

    point: MeasuredPoint
    system: LoadSystem
    settings: ContinuationSettings
    branch: Branch
    amplitude: FloatArray

    def crossing(self) -> LoadAtAmplitude:
        """Return the load at which the amplitude is the measured one.

        Raises
        ------
        InputError : the branch does not reach it within the range that the model may be followed in.
        """
        wanted = self.point.amplitude
        rows = np.flatnonzero((self.amplitude[:-1] < wanted) != (self.amplitude[1:] < wanted))
        if rows.size == 0:
            raise InputError(
                "the model does not reach the measured amplitude",
                where=self.point.name,
                value=f"{1e3 * wanted:.4g} mm, the model goes up to {1e3 * self.amplitude.max():.4g} mm "
                f"within {LIMIT:g} times its trained amplitudes",
                advice="check the unit and the sensor, or train on larger motions",
            )
        row = int(rows[0])
        share = (wanted - self.amplitude[row]) / (self.amplitude[row + 1] - self.amplitude[row])
        v = np.column_stack([self.branch.x, self.branch.p])[row : row + 2]
        return self._solved((1.0 - share) * v[0] + share * v[1], rows.size)

    def amplitude_at_level(self) -> float:
        """Return the amplitude in m under the level of the point, the one nearest to the measurement; nan if none."""
        p, level = self.branch.p, self.point.level
        rows = np.flatnonzero((p[:-1] < level) != (p[1:] < level))
        if rows.size == 0:
            return float("nan")
        share = (level - p[rows]) / (p[rows + 1] - p[rows])
        read = (1.0 - share) * self.amplitude[rows] + share * self.amplitude[rows + 1]
        k = int(np.argmin(np.abs(read - self.point.amplitude)))
        guess = (1.0 - share[k]) * self.branch.x[rows[k]] + share[k] * self.branch.x[rows[k] + 1]
        x = solve_at(self.system, guess, level, replace(self.settings, iterations=NEWTON_STEPS))
        return float(self.system.amplitudes(x[None], level, self.point)[0])

    def _solved(self, v: FloatArray, crossings: int) -> LoadAtAmplitude:
        """Return the solution of F = 0, amplitude = measured by Newton's method from v = (x, w, p)."""
        wanted = self.point.amplitude
        for _ in range(NEWTON_STEPS):
            residual, J = self._bordered(v)
            update = np.linalg.solve(J, -residual)
            v = v + update
            if np.max(np.abs(update / self._scale)) < NEWTON_TOLERANCE:
                break
        else:
            raise NumericalError(
                "Newton's method found no load for the measured amplitude",
                where=self.point.name,
                value=f"{1e3 * wanted:.4g} mm",
                advice="leave the point out, or take one further away from a fold",
            )
        J = self._bordered(v)[1]
        aimed, turned = np.zeros(v.size), np.zeros(v.size)
        aimed[-1] = 1.0  # in units of the amplitude
        omega = self.system.frequency(v[:-1])
        turned[-2] = omega / self.system.spread if self.system.phase is None else 0.0
        return LoadAtAmplitude(
            level=float(v[-1]),
            frequency_hz=omega / (2.0 * np.pi),
            q=self.system.still.modal(v[None, :-2])[0],
            by_amplitude=float(np.linalg.solve(J, aimed)[-1] / v[-1]),
            by_frequency=float(np.linalg.solve(J, turned)[-1] / v[-1]),
            stable=bool(np.all(np.abs(self.system.multipliers(v[:-1], float(v[-1]))) < 1.0)),
            crossings=crossings,
        )

    @property
    def _scale(self) -> FloatArray:
        return np.append(np.full(self.branch.x.shape[1], self.settings.state_scale), self.settings.parameter_scale)

    def _bordered(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residual and Jacobian (n + 2, n + 2) of (F, condition, amplitude over measured - 1)."""
        F, J_x, J_p = self.system.linearise(v[:-1], float(v[-1]))
        h = DIFFERENCE * self._scale
        shifts = np.diag(h[:-1])
        rows = np.vstack([v[:-1], v[:-1] + shifts, v[:-1] - shifts])
        a = self.system.amplitudes(rows, float(v[-1]), self.point)
        more, less = (self.system.amplitudes(v[None, :-1], float(v[-1] + s * h[-1]), self.point)[0] for s in (1, -1))
        n = len(shifts)
        slope = np.append((a[1 : n + 1] - a[n + 1 :]) / (2.0 * h[:-1]), (more - less) / (2.0 * h[-1]))
        residual = np.append(F, a[0] / self.point.amplitude - 1.0)
        return residual, np.vstack([np.column_stack([J_x, J_p]), slope / self.point.amplitude])


def load_path(model: ReducedModel, column: ComplexArray, point: MeasuredPoint) -> LoadPath:
    """Follow the forced orbits of a model from rest along a growing load, at the frequency of a point or in resonance.

    Parameters
    ----------
    column : (m,) G of the input, 1/s per input unit.

    Raises
    ------
    InputError : the load does not drive the mode, or the sensor does not see it.
    NumericalError : no orbit was found at a small load.
    """
    if column[point.mode] == 0.0:
        raise InputError("the load does not drive the mode", where=point.name, value=f"mode {point.mode + 1}")
    system = _load_system(model, column, point)
    trained, linear = float(np.max(model.trained_amplitude)), system.loaded(1.0).linear_response(system.omega)
    small = SMALL * trained / float(np.max(np.abs(linear)))
    needed = small * point.amplitude / _linear_amplitude(system, small, point)
    reached = float(np.max(np.abs(linear))) * needed
    # A resonance is not defined at rest; a fixed frequency is followed from there, since past a fold far from the
    # linear resonance less load is needed than on the way to it.
    share = FIRST_SHARE * min(1.0, trained / reached)
    first = share * needed if point.peak else 0.0
    start = system.loaded(first)
    x0 = np.append(start.start(start.linear_response(system.omega), system.omega), 0.0)
    settings = ContinuationSettings(
        parameter_range=(first, float("inf")),
        state_scale=trained,
        parameter_scale=needed * trained / reached,
        first_step=min(0.02, share * reached / trained),
        state_limit=min(AHEAD * reached, LIMIT * trained),
    )
    path = _followed(system, x0, first, settings, point)
    if path.amplitude.max() < point.amplitude:
        path = _followed(system, x0, first, replace(settings, state_limit=LIMIT * trained), point)
    return path


def _followed(
    system: LoadSystem, x0: FloatArray, first: float, settings: ContinuationSettings, point: MeasuredPoint
) -> LoadPath:
    try:
        branch = continue_branch(system, x0, first, settings)
    except NumericalError as error:
        raise NumericalError("no forced orbit at a small load", where=point.name, history=error.history) from error
    read = [system.amplitudes(x[None], p, point)[0] for x, p in zip(branch.x, branch.p, strict=True)]
    return LoadPath(point, system, settings, branch, np.array(read, dtype=np.float64))


def _load_system(model: ReducedModel, column: ComplexArray, point: MeasuredPoint) -> LoadSystem:
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


def _linear_amplitude(system: LoadSystem, p: float, point: MeasuredPoint) -> float:
    """Return the amplitude of the linear answer to a small load p, m."""
    loaded = system.loaded(p)
    x = loaded.start(loaded.linear_response(system.omega), system.omega)
    read = orbit_amplitudes(
        system.model, loaded.orbits(x[None], np.array([system.omega]), SAMPLES * loaded.forced)
    ).sqrt2_rms[0]
    if read[point.sensor] < SEEN * read.max():
        sensor = system.model.sensors[point.sensor]
        raise InputError("the sensor does not see the driven mode", where=point.name, value=sensor)
    return float(read[point.sensor])
