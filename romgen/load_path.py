"""Forced periodic orbits along a growing load, and the load at which one sensor shows a measured amplitude.

Near a fold the amplitude is multivalued in the load at a fixed frequency, but along the branch from rest the load is a
function of the amplitude: every measured amplitude belongs to one load, also on steep and on unstable parts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.branch import Branch, ContinuationSettings
from romgen.continuation import continue_branch, solve_at
from romgen.errors import InputError, NumericalError
from romgen.forced_response import LIMIT
from romgen.forcing import input_at_states
from romgen.lifted_orbit import SAMPLES, orbit_amplitudes
from romgen.load_system import LoadSystem, MeasuredPoint, load_system
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
    input_change : how much stronger than at rest the load acts on the driven mode along this orbit, by the chart of the
        model (``romgen.forcing.input_at_states``); the model itself keeps the value at rest.
    """

    level: float
    frequency_hz: float
    q: ComplexArray
    by_amplitude: float
    by_frequency: float
    stable: bool
    crossings: int
    input_change: float


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
        try:
            x = solve_at(self.system, guess, level, replace(self.settings, iterations=NEWTON_STEPS))
        except NumericalError:  # on a fold of the level the state there is not isolated
            return float("nan")
        return float(self.system.amplitudes(x[None], level, self.point)[0])

    def _solved(self, v: FloatArray, crossings: int) -> LoadAtAmplitude:
        """Return the solution of F = 0, amplitude = measured by Newton's method from v = (x, w, p)."""
        v = self._corrected(v)
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
            input_change=self._input_change(v),
        )

    def _corrected(self, v: FloatArray) -> FloatArray:
        """Return the solution v = (x, w, p) that Newton's method reaches."""
        updates: list[float] = []
        for _ in range(NEWTON_STEPS):
            residual, J = self._bordered(v)
            try:
                update = np.linalg.solve(J, -residual)
            except np.linalg.LinAlgError:
                break
            v = v + update
            updates.append(float(np.max(np.abs(update / self._scale))))
            if updates[-1] < NEWTON_TOLERANCE and v[-1] > 0.0:
                return v
        raise NumericalError(
            "Newton's method found no load for the measured amplitude",
            where=self.point.name,
            value=f"{1e3 * self.point.amplitude:.4g} mm",
            advice="leave the point out, or take one at another level",
            history=tuple(updates),
        )

    def _input_change(self, v: FloatArray) -> float:
        """Return abs(mean of 2 e^{-i phi} G_j(z(phi)) cos(phi)) / abs(G_j) - 1 over the orbit of v, load cos(phi)."""
        system, mode = self.system, self.system.mode
        loaded = system.loaded(float(v[-1]))
        n = SAMPLES * loaded.forced
        z = loaded.orbits(v[None, :-2], np.array([system.frequency(v[:-1])]), n)[0]
        phase = 2.0 * np.pi * loaded.forced * np.arange(n) / n
        try:
            G = input_at_states(system.model, z, system.column)[:, mode]
        except np.linalg.LinAlgError:  # the chart folds over, far outside its range
            return float("nan")
        mean = np.mean(2.0 * np.exp(-1j * phase) * G * np.cos(phase))
        return float(np.abs(mean / system.column[mode])) - 1.0

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
    system = load_system(model, column, point)
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
