"""Frequency response of a reduced model by continuation, with stability and detached branches."""

from __future__ import annotations

import time

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.backbone import normal_motion
from romgen.branch import Branch, ContinuationSettings
from romgen.continuation import continue_branch
from romgen.detached_branches import crossing_starts, detached_branches, random_starts
from romgen.errors import InputError, NumericalError
from romgen.forced_curve import ForcedCurve, ForcedResponse, ForcedSystem, Observation, forced_curve
from romgen.forcing import harmonic_load
from romgen.periodic_orbit import harmonic_balance
from romgen.reduced_model import ReducedModel
from romgen.rotating_frame import RotatingFrame, rotating_frame, rotations
from romgen.settings import ForcedResponseSettings

HARMONICS = 9
# A branch is followed, flagged, up to this multiple of the trained amplitude; polynomials mean nothing beyond.
LIMIT = 1.5
# Half-bandwidths abs(Re lambda) added to the automatic range on both sides, and its least half-width.
MARGIN, LEAST_WIDTH = 12.0, 0.03
SEARCH_FREQUENCIES, SEARCH_TRIES = 7, 12
BACKBONE_POINTS = 80

Motion = tuple[ComplexArray, ComplexArray, FloatArray]


def forced_response(model: ReducedModel, settings: ForcedResponseSettings) -> ForcedResponse:
    """Return the frequency response curves of all levels of one load input.

    Equilibria in the rotating frame where every term is resonant, otherwise harmonic balance on the complete model;
    both by continuation, then a search for further branches.

    Parameters
    ----------
    settings : input, levels (amplitude of the cosine), sensor, measure, frequency range. Without a range it follows
        from the eigenvalue and the backbone. The mode nearest to the middle of the range is taken as driven.

    Raises
    ------
    InputError : unknown input or sensor, or no level.
    NumericalError : a curve could not be started from either end of the range.

    Source: Morsy et al. 2024; Breunung, Haller 2018.
    """
    started = time.perf_counter()
    _check(model, settings)
    highest = harmonic_load(model, settings.input, max(settings.levels, key=abs))
    mode = _forced_mode(model, highest, settings.frequency_range_hz)
    range_hz = settings.frequency_range_hz or _automatic_range(model, highest, mode)
    sensor = model.sensors.index(settings.sensor) if settings.sensor else 0
    unit = model.input_units[model.inputs.index(settings.input)]
    curves, motions = list[ForcedCurve](), _motions(model, mode)
    for level in settings.levels:
        observed = Observation(settings.input, unit, level, mode, sensor, settings.measure)
        curves += _curves_of_level(model, range_hz, observed, motions)
    frame = rotating_frame(model, highest, mode)
    return ForcedResponse(
        curves=tuple(curves),
        route="rotating_frame" if _all_resonant(frame) else "periodic_orbit",
        sensors=model.sensors,
        sensor=model.sensors[sensor],
        measure=settings.measure,
        frequency_range_hz=range_hz,
        notes=_notes(model, settings, frame, mode, curves),
        wall_s=time.perf_counter() - started,
    )


def forced_system(model: ReducedModel, load: ComplexArray, forced_mode: int) -> ForcedSystem:
    """Return the rotating frame where all terms are resonant, else the harmonic balance of the complete model.

    Parameters
    ----------
    load : (m,) f on exp(+i Omega t), 1/s.
    """
    frame = rotating_frame(model, load, forced_mode)
    return frame if _all_resonant(frame) else harmonic_balance(model, load, forced_mode, HARMONICS * frame.forced)


def _all_resonant(frame: RotatingFrame) -> bool:
    return not np.any(frame.dropped_terms > 0.0)


def _curves_of_level(
    model: ReducedModel, range_hz: tuple[float, float], observed: Observation, motions: list[Motion]
) -> list[ForcedCurve]:
    """Follow the main branch and all further ones at one level."""
    load = harmonic_load(model, observed.input, observed.level)
    system = forced_system(model, load, observed.forced_mode)
    lower, upper = 2.0 * np.pi * range_hz[0], 2.0 * np.pi * range_hz[1]
    settings = _continuation(model, load, observed.forced_mode, (lower, upper))
    main = _main_branch(system, settings, observed.level)
    guesses = [(system.linear_response(omega), omega) for omega in (lower, upper)]
    ridge = _ridge_starts(motions, observed.forced_mode, load)
    guesses += [(q, omega) for q, omega in ridge if lower < omega < upper]
    guesses += random_starts(model.trained_amplitude, (lower, upper), SEARCH_FREQUENCIES, SEARCH_TRIES)
    starts = crossing_starts(system, [main], settings)
    starts += [(system.start(q, omega), omega) for q, omega in guesses]
    further = detached_branches(system, [main], starts, model.trained_amplitude, settings)
    return [forced_curve(model, system, branch, k, observed) for k, branch in enumerate([main, *further])]


def _main_branch(system: ForcedSystem, settings: ContinuationSettings, level: float) -> Branch:
    """Return the branch that starts from the linear response at the lower, or else the upper end of the range."""
    histories: list[float] = []
    for omega in settings.parameter_range:
        try:
            return continue_branch(system, system.start(system.linear_response(omega), omega), omega, settings)
        except NumericalError as error:
            histories += error.history
    raise NumericalError(
        "no periodic orbit was found at either end of the frequency range",
        where="forced response",
        value=f"level {level:g}, {settings.parameter_range[0] / 2 / np.pi:.6g} .. "
        f"{settings.parameter_range[1] / 2 / np.pi:.6g} Hz",
        advice="widen frequency_range_hz or lower the level",
        history=tuple(histories),
    )


def _continuation(
    model: ReducedModel, load: ComplexArray, mode: int, omega_range: tuple[float, float]
) -> ContinuationSettings:
    """Return the settings with the linear peak (at most the trained amplitude) and the bandwidth as units."""
    half_bandwidth = abs(float(model.eigenvalues[mode].real))
    trained = float(np.max(model.trained_amplitude))
    peak = float(np.abs(load[mode])) / half_bandwidth
    return ContinuationSettings(
        parameter_range=omega_range,
        state_scale=min(peak, trained),
        parameter_scale=2.0 * half_bandwidth,
        state_limit=LIMIT * trained,
    )


def _forced_mode(model: ReducedModel, load: ComplexArray, range_hz: tuple[float, float] | None) -> int:
    """Return the mode nearest to the middle of the range, or the one that the load drives furthest near resonance."""
    if range_hz is not None:
        middle = np.pi * (range_hz[0] + range_hz[1])
        mode = int(np.argmin(np.abs(model.eigenvalues.imag - middle)))
    else:
        r = rotations(model)
        peak = np.abs(load / model.eigenvalues.real)
        primary = np.where(r == r.min(), peak, 0.0)
        mode = int(np.argmax(primary if np.any(primary) else peak))
    if load[mode] == 0.0:
        raise InputError(
            "the load does not drive this mode",
            where=f"forced response of {model.name}",
            value=f"mode {mode + 1}",
            advice="choose another input or frequency range",
        )
    return mode


def _automatic_range(model: ReducedModel, load: ComplexArray, mode: int) -> tuple[float, float]:
    """Return in Hz the frequencies of the backbone up to the linear peak or the trained amplitude, and a margin."""
    eigenvalue = model.eigenvalues[mode]
    largest = min(abs(load[mode] / eigenvalue.real), float(model.trained_amplitude[mode]))
    _, rate = normal_motion(model, mode, False, largest * np.linspace(0.02, 1.0, 50))
    omega = np.append(rate.imag, eigenvalue.imag)
    margin = float(max(MARGIN * abs(eigenvalue.real), LEAST_WIDTH * eigenvalue.imag))
    lower = max(float(omega.min()) - margin, 0.2 * float(eigenvalue.imag))
    return lower / (2.0 * np.pi), float(omega.max() + margin) / (2.0 * np.pi)


def _ridge_starts(motions: list[Motion], mode: int, load: ComplexArray) -> list[tuple[ComplexArray, float]]:
    """Return the phase-resonant guesses of one level: on a backbone, where the damping force equals the load.

    q_mode = rho f / abs(f) with -Re(n_mode / q_mode) rho = abs(f); every isola around a backbone holds two of them.
    """
    starts: list[tuple[ComplexArray, float]] = []
    size, direction = float(np.abs(load[mode])), np.angle(load[mode])
    for q, rate, ratio in motions:
        rho = np.abs(q[:, mode])
        surplus = -rate.real * rho - size
        for i in np.flatnonzero(surplus[:-1] * surplus[1:] < 0.0):
            share = surplus[i] / (surplus[i] - surplus[i + 1])
            point = (1.0 - share) * q[i] + share * q[i + 1]
            omega = (1.0 - share) * rate[i].imag + share * rate[i + 1].imag
            starts.append((np.asarray(point * np.exp(1j * ratio * direction)), float(omega)))
    return starts


def _motions(model: ReducedModel, mode: int) -> list[Motion]:
    """Return the backbones of the driven mode, the others zero and, where they can lock, slaved; r_k / r_mode each."""
    rho = float(model.trained_amplitude[mode]) * np.linspace(0.01, 1.0, BACKBONE_POINTS)
    ratio = rotations(model) / rotations(model)[mode]
    can_lock = len(model.internal_resonance) > 1 and not np.any(ratio % 1.0)
    return [(*normal_motion(model, mode, slaved, rho), ratio) for slaved in ((False, True) if can_lock else (False,))]


def _check(model: ReducedModel, settings: ForcedResponseSettings) -> None:
    where = "[forced_response]"
    if not settings.levels or 0.0 in settings.levels:
        raise InputError("levels must be non-zero numbers", where=where, value=settings.levels)
    if settings.sensor is not None and settings.sensor not in model.sensors:
        advice = f"choose one of {', '.join(model.sensors)}"
        raise InputError("unknown sensor", where=where, value=settings.sensor, advice=advice)


def _notes(
    model: ReducedModel,
    settings: ForcedResponseSettings,
    frame: RotatingFrame,
    mode: int,
    curves: list[ForcedCurve],
) -> tuple[str, ...]:
    """Say every choice and omission."""
    notes = ["amplitudes are those of the whole displacement; the mean is not removed"]
    if settings.sensor is None:
        notes.append(f"no sensor was named: peaks are read at {model.sensors[0]}")
    if settings.frequency_range_hz is None:
        notes.append("the frequency range follows from the eigenvalue and the backbone at the highest level")
    if frame.forced > 1:
        notes.append(f"mode {mode + 1} is driven; answers of period {frame.forced} forcing periods are included")
    if not _all_resonant(frame):
        notes.append(f"some terms are not resonant: harmonic balance with {HARMONICS} harmonics on the complete model")
    elif np.any(frame.dropped_load):
        rows = ", ".join(str(j + 1) for j in np.flatnonzero(frame.dropped_load))
        notes.append(f"the load on mode {rows} is not resonant: it enters the orbit to first order only")
    if any(np.any(curve.exceeds_trained_range) for curve in curves):
        notes.append("some points lie outside the trained range: see exceeds_trained_range")
    stopped = sorted({f"level {curve.level:g}: {end}" for curve in curves for end in curve.ends} - _regular(curves))
    return (*notes, *(f"a branch does not reach the end of the range, {reason}" for reason in stopped))


def _regular(curves: list[ForcedCurve]) -> set[str]:
    return {f"level {curve.level:g}: {end}" for curve in curves for end in ("range", "closed")}
