"""Load inputs of a model learned from recorded data: calibrated on measured steady states, or from a participation.

The data alone do not say how a load enters eta_j'' = ... + f_j u. Each measured point gives the load level at which the
model shows its amplitude (``romgen.load_path``); the f that make these levels those of the measurement follow by least
squares of their logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.forcing import sensor_shapes, with_inputs
from romgen.lifted_orbit import Measure
from romgen.load_fit import LoadFit, LoadProblem, fit_load
from romgen.load_notes import calibration_notes, participation_notes
from romgen.load_system import MeasuredPoint
from romgen.reduced_model import ReducedModel
from romgen.settings import BASE_ACCELERATION, ForcedPointSettings, ForcingSettings

# A sensor with less than this share of the largest entry of a shape says nothing about its participation.
SEEN = 0.05


@dataclass(frozen=True)
class CalibratedPoint:
    """A measured point and what the calibrated model makes of it.

    Attributes
    ----------
    level, unit : amplitude of the cosine on the input.
    frequency_hz : of the point; of the model where a peak was given without.
    peak : the point is the peak of the response.
    resonance_hz : phase resonance of the model at the same amplitude; nan where it has none.
    sensor, measure, measured_m : what was measured.
    model_m : the model under the same level, nearest to the measurement; nan where it has no such state.
    level_needed : level at which the model shows ``measured_m``.
    deviation_percent : 100 (level_needed / level - 1); its spread over the points is the error of the scale.
    expected_percent : deviation that 2 % in amplitude and level and 0.1 % in frequency explain; sets the weight.
    by_amplitude, by_frequency : d ln level / d ln amplitude and d ln level / d ln frequency.
    input_change_percent : how much stronger than at rest the load acts at this amplitude, which the model leaves out.
    mode : driven mode, from 1.
    distance : of the state in units of the trained range (above 1: outside).
    stable : in the model.
    """

    level: float
    unit: str
    frequency_hz: float
    peak: bool
    resonance_hz: float
    sensor: str
    measure: Measure
    measured_m: float
    model_m: float
    level_needed: float
    deviation_percent: float
    expected_percent: float
    by_amplitude: float
    by_frequency: float
    input_change_percent: float
    mode: int
    distance: float
    stable: bool


@dataclass(frozen=True)
class InputLoad:
    """One load input and where it comes from.

    Attributes
    ----------
    input, unit : name and SI unit.
    source : "points" or "participation".
    modal_load : (m,) f of eta'' = ... + f u, in the data's own normalisation of eta (m).
    deviation_percent : (m,) standard deviation of f; nan where f is 0 or was given.
    spread_percent : weighted standard deviation of the deviations of the points; nan for no more points than loads.
    points : the measured points.
    notes : what a user has to know.
    """

    input: str
    unit: str
    source: str
    modal_load: FloatArray = field(metadata={"unit": "m/s^2 per input unit", "axes": "mode"})
    deviation_percent: FloatArray = field(metadata={"unit": "percent", "axes": "mode"})
    spread_percent: float
    points: tuple[CalibratedPoint, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Forcing:
    """All load inputs of recorded data, in the order of the study."""

    loads: tuple[InputLoad, ...]

    def applied(self, model: ReducedModel) -> ReducedModel:
        """Return the model with these inputs.

        Raises
        ------
        InputError : the model has inputs already, which these would replace.
        """
        if model.inputs:
            raise InputError(
                "the model has load inputs already",
                where=f"model {model.name}",
                value=", ".join(model.inputs),
                advice="find all loads in one call and apply them to the model as learned",
            )
        columns = np.column_stack([load.modal_load for load in self.loads])
        return with_inputs(
            model, tuple(load.input for load in self.loads), tuple(load.unit for load in self.loads), columns
        )


def calibrate_forcing(
    model: ReducedModel, tables: Mapping[str, ForcingSettings], measure: Measure = "sqrt2_rms"
) -> Forcing:
    """Return the load inputs of a model without inputs; ``applied`` then gives the model with them.

    Parameters
    ----------
    tables : name of the input -> table [forcing.<name>]; base_acceleration in m/s2, any other in N.
    measure : of points that name none.

    Raises
    ------
    InputError : an unknown sensor or mode, an amplitude out of reach, points that do not determine a load.
    NumericalError : an orbit was not found.

    Source: after ``calibrateFRC`` of Cenedese et al. 2022 (one point, one mode), by continuation and for many points.
    """
    return Forcing(tuple(_input_load(model, name, table, measure) for name, table in tables.items()))


def _input_load(model: ReducedModel, name: str, table: ForcingSettings, measure: Measure) -> InputLoad:
    where, unit = f"[forcing.{name}]", "m/s2" if name == BASE_ACCELERATION else "N"
    _check(model, where, table)
    if table.participation:
        return _from_participation(model, (name, unit, where), table.participation)
    points = [_measured(model, f"{where} point {k}", point, measure) for k, point in enumerate(table.points, 1)]
    loaded = tuple(sorted(mode - 1 for mode in table.modes)) or tuple(sorted({point.mode for point in points}))
    for point in points:
        if point.mode not in loaded:
            advice = f"add {point.mode + 1} to modes, or leave the point out"
            raise InputError("the mode nearest to it is not loaded", where=point.name, value=table.modes, advice=advice)
    sign = table.sign or (-1 if name == BASE_ACCELERATION else 1)
    fit = fit_load(LoadProblem(model, points, loaded, where), float(sign))
    return InputLoad(
        input=name,
        unit=unit,
        source="points",
        modal_load=fit.modal_load,
        deviation_percent=fit.deviation_percent,
        spread_percent=fit.spread_percent,
        points=tuple(_calibrated(model, unit, fit, k) for k in range(len(points))),
        notes=calibration_notes(model, name, fit, sign),
    )


def _check(model: ReducedModel, where: str, table: ForcingSettings) -> None:
    """Refuse sensors and modes that the model does not have; a study file has been checked before."""
    for sensor in [*(point.sensor for point in table.points), *table.participation]:
        if sensor not in model.sensors:
            advice = f"choose one of {', '.join(model.sensors)}"
            raise InputError("unknown sensor", where=where, value=sensor, advice=advice)
    m = model.eigenvalues.size
    for mode in [*table.modes, *(point.mode or 1 for point in table.points)]:
        if mode > m:
            raise InputError("no such mode", where=where, value=mode, advice=f"modes are numbered from 1 to {m}")
    for shares in table.participation.values():
        if len(shares) != m:
            raise InputError("participation needs one number per master mode", where=where, value=shares)


def _measured(model: ReducedModel, name: str, point: ForcedPointSettings, measure: Measure) -> MeasuredPoint:
    mode = (point.mode or 1) - 1
    if point.frequency_hz is not None:
        mode = int(np.argmin(np.abs(model.eigenvalues.imag - 2.0 * np.pi * point.frequency_hz)))
    sensor = model.sensors.index(point.sensor)
    peak = point.peak or point.frequency_hz is None
    shown = point.measure or measure
    return MeasuredPoint(name, point.level, point.frequency_hz, sensor, shown, point.amplitude, mode, peak)


def _calibrated(model: ReducedModel, unit: str, fit: LoadFit, k: int) -> CalibratedPoint:
    path, at, resonance = fit.paths[k], fit.needed[k], fit.resonances[k]
    point = path.point
    return CalibratedPoint(
        level=point.level,
        unit=unit,
        frequency_hz=at.frequency_hz if point.frequency_hz is None else point.frequency_hz,
        peak=point.peak,
        resonance_hz=float("nan") if resonance is None else resonance.frequency_hz,
        sensor=model.sensors[point.sensor],
        measure=point.measure,
        measured_m=point.amplitude,
        model_m=path.amplitude_at_level(),
        level_needed=at.level,
        deviation_percent=100.0 * (at.level / point.level - 1.0),
        expected_percent=float(fit.expected_percent[k]),
        by_amplitude=at.by_amplitude,
        by_frequency=at.by_frequency,
        input_change_percent=100.0 * at.input_change,
        mode=point.mode + 1,
        distance=float(model.trained_range.distance(at.q[None])[0]),
        stable=at.stable,
    )


def _from_participation(
    model: ReducedModel, named: tuple[str, str, str], participation: Mapping[str, Sequence[float]]
) -> InputLoad:
    """f_j by least squares from Phi_sj f_j = acceleration of sensor s in mode j per unit input."""
    name, unit, where = named
    rows = [model.sensors.index(sensor) for sensor in participation]
    shapes, shares = sensor_shapes(model), np.array(list(participation.values()), dtype=np.float64)
    seen = np.max(np.abs(shapes[rows]), axis=0) >= SEEN * np.max(np.abs(shapes), axis=0)
    for j in np.flatnonzero(~seen & np.any(shares != 0.0, axis=0)):
        raise InputError(
            f"these sensors do not see mode {j + 1}",
            where=f"{where} participation",
            value=", ".join(participation),
            advice="give a sensor that moves with it, or 0",
        )
    square = np.sum(shapes[rows] ** 2, axis=0)
    push = np.sum(shapes[rows] * shares, axis=0)
    f = np.divide(push, square, out=np.zeros_like(push), where=seen)
    notes = participation_notes(model, name, f, (shapes[rows], shares))
    unknown = np.full(f.size, np.nan)
    return InputLoad(name, unit, "participation", f, unknown, float("nan"), (), notes)
