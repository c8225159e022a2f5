"""The reduced model against the finite-element model under a harmonic load, point by point.

Both start from the same periodic motion of the reduced model, lifted to all degrees of freedom, and are forced for the
same time: were the reduced model exact, both would stay on that orbit.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.forced_curve import ForcedCurve, ForcedResponse
from romgen.forced_motion import ForcedMotion, cosine
from romgen.lifted_orbit import Measure
from romgen.manifold import Manifold, lift
from romgen.reduced_model import ReducedModel
from romgen.simulate import coordinates, sensors, simulate

# Decay times of the slowest mode: what the harmonic start leaves of a transient falls to exp(-10) = 5e-5.
SETTLING = 10.0
# Samples per period of the input, piecewise linear: its amplitude is short by (pi / n)^2 / 3, 1e-5 here.
SAMPLES = 512
MEASURED_PERIODS = 5


@dataclass(frozen=True)
class OperatingPoint:
    """A stable forced motion of the reduced model: load level cos(2 pi f t) on ``input``, state z at t = 0."""

    input: str
    level: float
    unit: str
    frequency_hz: float
    z: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})


@dataclass(frozen=True)
class ForcedPoint:
    """One operating point in both models.

    Attributes
    ----------
    load, unit, frequency_hz : load cos(2 pi f t) on ``input``.
    sensor, measure : what is compared.
    rom_m, fe_m : that measure over the last five periods, m; error_percent : 100 (rom_m / fe_m - 1).
    drift_percent : change of fe_m over the second half of the run; where it is not small the error still grows.
    t : (n_time,) s; rom, fe : (n_time,) m, the sensor in both models.
    """

    load: float
    unit: str
    frequency_hz: float
    sensor: str
    measure: Measure
    rom_m: float
    fe_m: float
    error_percent: float
    drift_percent: float
    input: str
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    rom: FloatArray = field(metadata={"unit": "m", "axes": "time"})
    fe: FloatArray = field(metadata={"unit": "m", "axes": "time"})


@dataclass(frozen=True)
class ForcedValidation:
    """All operating points that were computed in both models."""

    points: tuple[ForcedPoint, ...]


def operating_points(
    model: ReducedModel, response: ForcedResponse, shares: tuple[float, ...]
) -> tuple[OperatingPoint, ...]:
    """Per level the stable points whose amplitude is nearest to the given shares of the largest stable one.

    The motion is settled by simulation, so that its state carries all harmonics.
    """
    points = []
    for curve in response.curves:
        if curve.branch != 0 or not (curve.stable & ~curve.exceeds_trained_range).any():
            continue
        amplitude = _amplitude(curve, response)
        usable = np.flatnonzero(curve.stable & ~curve.exceeds_trained_range)
        for share in shares:
            chosen = int(usable[np.abs(amplitude[usable] - share * amplitude[usable].max()).argmin()])
            points.append(_settled(model, curve, chosen))
    if not points:
        raise InputError("no stable point inside the trained range", where="forced validation")
    return tuple(points)


def _amplitude(curve: ForcedCurve, response: ForcedResponse) -> FloatArray:
    table = curve.amplitude_max if response.measure == "max" else curve.amplitude_sqrt2_rms
    column: FloatArray = table[:, response.sensors.index(response.sensor)]
    return column


def _settled(model: ReducedModel, curve: ForcedCurve, row: int) -> OperatingPoint:
    frequency = float(curve.frequency_hz[row])
    periods = int(np.ceil(SETTLING / np.abs(model.eigenvalues.real).min() * frequency))
    t = np.arange(periods * SAMPLES + 1) / (SAMPLES * frequency)
    z = simulate(model, t, curve.q[row], _cosine(model, curve.input, curve.level, frequency, t))
    return OperatingPoint(curve.input, curve.level, curve.unit, frequency, z[-1])


def _cosine(model: ReducedModel, name: str, level: float, frequency_hz: float, t: FloatArray) -> FloatArray:
    """Samples of the load on one input, (n_time, n_input)."""
    u = np.zeros((len(t), len(model.inputs)))
    u[:, model.inputs.index(name)] = level * np.cos(2.0 * np.pi * frequency_hz * t)
    return u


def forced_motion(model: ReducedModel, full: Manifold, points: tuple[OperatingPoint, ...], n_step: int) -> ForcedMotion:
    """Lift the state of every point to all degrees of freedom.

    The velocity is the difference quotient of the lifted motion over 1e-7 s (relative error omega h / 2 = 1e-4 at
    300 Hz).
    """
    step = 1e-7
    displacement, velocity = [], []
    for point in points:
        t = np.array([0.0, step])
        z = simulate(model, t, point.z, _cosine(model, point.input, point.level, point.frequency_hz, t))
        x = lift(full, coordinates(model, z))
        displacement.append(x[0])
        velocity.append((x[1] - x[0]) / step)
    level = np.array([point.level for point in points])
    omega = 2.0 * np.pi * np.array([point.frequency_hz for point in points])
    # All points belong to one frequency response, and that to one input.
    loads = {points[0].input: cosine(level, omega)}
    return ForcedMotion(np.stack(displacement, axis=1), np.stack(velocity, axis=1), loads, n_step)


def compare(
    model: ReducedModel, point: OperatingPoint, t: FloatArray, fe: FloatArray, sensor: str, measure: Measure
) -> ForcedPoint:
    """Run the reduced model over t (n_time,) from the same state and compare the sensor with fe (n_time,)."""
    fine = np.arange(int(np.ceil(t[-1] * SAMPLES * point.frequency_hz)) + 1) / (SAMPLES * point.frequency_hz)
    z = simulate(model, fine, point.z, _cosine(model, point.input, point.level, point.frequency_hz, fine))
    rom = np.interp(t, fine, sensors(model, z)[0][:, model.sensors.index(sensor)])
    period = 1.0 / point.frequency_hz
    rom_m, fe_m = (_measure(t, x, t[-1], period, measure) for x in (rom, fe))
    halfway = _measure(t, fe, 0.5 * t[-1], period, measure)
    return ForcedPoint(
        load=point.level,
        unit=point.unit,
        frequency_hz=point.frequency_hz,
        sensor=sensor,
        measure=measure,
        rom_m=rom_m,
        fe_m=fe_m,
        error_percent=100.0 * (rom_m / fe_m - 1.0),
        drift_percent=100.0 * (fe_m / halfway - 1.0),
        input=point.input,
        t=t,
        rom=rom,
        fe=fe,
    )


def _measure(t: FloatArray, x: FloatArray, end: float, period: float, measure: Measure) -> float:
    """The measure over the last whole periods before ``end``, resampled so that the window is exact."""
    window = np.linspace(end - MEASURED_PERIODS * period, end, MEASURED_PERIODS * SAMPLES, endpoint=False)
    samples = np.interp(window, t, x)
    return float(np.abs(samples).max() if measure == "max" else np.sqrt(2.0 * np.mean(samples**2)))
