"""What a user should know about a load input that was not computed, one sentence each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from romgen.arrays import FloatArray
from romgen.forcing import chart_input_matrix, input_at_states
from romgen.lifted_orbit import SAMPLES
from romgen.load_fit import AMPLITUDE_ERROR, FREQUENCY_ERROR, LEVEL_ERROR, LoadFit
from romgen.reduced_model import ReducedModel

# Deviations of more than two expected ones are a conflict, not noise.
CONFLICT = 2.0
# A point within so many expected errors of the resonance may be meant as the peak, and needs more load the further the
# resonance of the model is off: from this on it is worth a word.
NEAR, WORTH_PERCENT = 2.5, 2.0
# Half of the error of forced amplitudes that is aimed at.
CHANGED_PERCENT = 1.0
# Share of the trained amplitude at which a given load is looked at.
HALF = 0.5
# A mode with less than this share of the largest load is hardly driven.
DRIVEN = 0.01
# Shapes of another model that differ by more belong to other modes or sensors.
OTHER_SHAPE_PERCENT = 10.0


def calibration_notes(model: ReducedModel, name: str, fit: LoadFit, sign: int) -> tuple[str, ...]:
    """Return what was calibrated from which points, what was assumed, and what the points say against the model."""
    return (
        _source(name, fit),
        *_unloaded(model, name, fit),
        _sign(model, name, fit, sign),
        *fit.notes,
        *_points(model, fit),
        *_resonances(fit),
    )


def participation_notes(
    model: ReducedModel, name: str, f: FloatArray, given: tuple[FloatArray, FloatArray]
) -> tuple[str, ...]:
    """Return that the load was given, and where several sensors contradict the shapes of the data.

    Parameters
    ----------
    f : (m,) modal load.
    given : Phi (n_row, m) of the sensors that were given, and their accelerations (n_row, m).
    """
    shapes, shares = given
    notes = [f"the load of input {name} was given by participation, not computed or measured"]
    notes += list(_changes(model, name, f))
    missed = 100.0 * np.linalg.norm(shares - shapes * f, axis=0)
    size = np.linalg.norm(shares, axis=0)
    notes += [
        f"the participation of mode {j + 1} fits its shape in the data to {missed[j] / size[j]:.0f} % only: are "
        "sensors, modes and signs those of the data?"
        for j in range(model.eigenvalues.size)
        if missed[j] > OTHER_SHAPE_PERCENT * size[j]
    ]
    return tuple(notes)


def _changes(model: ReducedModel, name: str, f: FloatArray) -> Iterator[str]:
    """How much differently the load acts on a mode in resonance at half its trained amplitude."""
    column = chart_input_matrix(model, f[:, None])[:, 0]
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    for j in np.flatnonzero(np.abs(f) > DRIVEN * np.max(np.abs(f))):
        z = np.zeros((SAMPLES, f.size), dtype=np.complex128)
        z[:, j] = HALF * model.trained_amplitude[j] * np.exp(1j * phase)
        G = input_at_states(model, z, column)[:, j]
        # the load in phase with the velocity: cos(phase - arg G)
        mean = np.mean(2.0 * np.exp(-1j * phase) * G * np.cos(phase - np.angle(column[j])))
        change = 100.0 * (float(np.abs(mean / column[j])) - 1.0)
        if abs(change) > CHANGED_PERCENT:
            yield (
                f"by the chart of the model input {name} acts {_changed(change)} on mode {j + 1} at half its "
                "trained amplitude than at rest; the model keeps one value: forced amplitudes err by about as much"
            )


def _source(name: str, fit: LoadFit) -> str:
    n = len(fit.needed)
    loads = ", ".join(f"{d:.1f} % on mode {j + 1}" for j, d in enumerate(fit.deviation_percent) if np.isfinite(d))
    base = f"the load of input {name} is not computed but calibrated on {n} measured point{'s' * (n > 1)}"
    if np.isnan(fit.spread_percent):
        return f"{base}, and nothing is left to check it by; if these err as expected its standard deviation is {loads}"
    return f"{base}, which spread by {fit.spread_percent:.1f} % in level; standard deviation of the load {loads}"


def _unloaded(model: ReducedModel, name: str, fit: LoadFit) -> Iterator[str]:
    rest = [str(j + 1) for j in range(model.eigenvalues.size) if np.isnan(fit.deviation_percent[j])]
    if rest:
        yield f"input {name} is taken not to drive mode {', '.join(rest)}: no measured point says how much it does"


def _sign(model: ReducedModel, name: str, fit: LoadFit, sign: int) -> str:
    sensor = model.sensors[fit.paths[0].point.sensor]
    way = "along" if sign > 0 else "against"
    return f"amplitudes do not show a sign: {sensor} is taken to accelerate {way} a positive {name} (key sign)"


def _points(model: ReducedModel, fit: LoadFit) -> Iterator[str]:
    for path, at, expected in zip(fit.paths, fit.needed, fit.expected_percent, strict=True):
        point = path.point
        off = 100.0 * np.log(at.level / point.level)
        if abs(off) > CONFLICT * expected:
            yield (
                f"{point.name}: the model needs {at.level:.4g} instead of {point.level:.4g}; errors of "
                f"{100 * AMPLITUDE_ERROR:g} % in amplitude, {100 * LEVEL_ERROR:g} % in level and "
                f"{100 * FREQUENCY_ERROR:g} % in frequency explain {expected:.1f} %"
            )
        distance = float(model.trained_range.distance(at.q[None])[0])
        if distance > 1.0:
            yield f"{point.name}: its amplitude lies outside the trained range, {distance:.2f} times its boundary"
        if not at.stable:
            yield f"{point.name}: the model is not stable there, a sweep would jump; its frequency may be off"
        if abs(100.0 * at.input_change) > CHANGED_PERCENT:
            yield (
                f"{point.name}: by the chart of the model the load acts here {_changed(100.0 * at.input_change)} "
                "than at rest; the model keeps one value, so the load holds near the amplitudes of the points"
            )
        if at.crossings > 1:
            yield f"{point.name}: the model shows this amplitude at {at.crossings} levels; the first from rest is taken"


def _changed(percent: float) -> str:
    return f"{abs(percent):.1f} % {'stronger' if percent > 0.0 else 'weaker'}"


def _resonances(fit: LoadFit) -> Iterator[str]:
    """Frequencies of peaks, and points that may be peaks: off its resonance the model needs more load, never less."""
    for path, at, peak in zip(fit.paths, fit.needed, fit.resonances, strict=True):
        point = path.point
        if peak is None or point.frequency_hz is None:
            continue
        off, more = point.frequency_hz - peak.frequency_hz, 100.0 * (at.level / peak.level - 1.0)
        here = f"{point.name}: at this amplitude the model resonates at {peak.frequency_hz:.2f} Hz"
        if point.peak and abs(off) > FREQUENCY_ERROR * peak.frequency_hz:
            yield f"{here}, the measured peak is at {point.frequency_hz:.2f} Hz"
        if not point.peak and abs(off) < NEAR * FREQUENCY_ERROR * peak.frequency_hz and more > WORTH_PERCENT:
            yield f"{here} and needs {more:.0f} % more load at {point.frequency_hz:.2f} Hz; is it a peak (peak = true)?"
