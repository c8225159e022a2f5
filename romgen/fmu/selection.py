"""What of a model goes into a unit: chosen sensors, and the checks at the door."""

from __future__ import annotations

import dataclasses
import re

import numpy as np

from romgen.errors import InputError
from romgen.fmu.compilers import requested_platforms
from romgen.fmu.records import FmuInfo, InterfaceOptions
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings

WHERE = "FMU export"
BASE_ACCELERATION = "base_acceleration"


def exported_model(model: ReducedModel, sensors: tuple[str, ...] | None) -> ReducedModel:
    """The model with the chosen sensors (all if None), fit for export.

    Raises
    ------
    InputError : for an unknown or no sensor, a name that is no C identifier, numbers that are not finite, a mode
        that does not oscillate, or one that was never excited in training.
    """
    _check_identifier(model.name)
    chosen = _with_sensors(model, model.sensors if sensors is None else sensors)
    for name, values in (
        ("eigenvalues", chosen.eigenvalues),
        ("normal_form", chosen.normal_form.coefficients),
        ("chart", chosen.chart.coefficients),
        ("displacement", chosen.displacement.coefficients),
        ("velocity", chosen.velocity.coefficients),
        ("input_matrix", chosen.input_matrix),
        ("trained_amplitude", chosen.trained_amplitude),
        ("trained_facets", chosen.trained_range.facets if np.all(chosen.trained_amplitude > 0.0) else np.zeros(1)),
    ):
        if not np.all(np.isfinite(values)):
            raise InputError(f"{name} holds numbers that are not finite", where=WHERE, advice="learn the model again")
    if not np.all(chosen.eigenvalues.imag > 0.0):
        raise InputError("a mode does not oscillate", where=WHERE, value=chosen.eigenvalues)
    if not np.all(chosen.trained_amplitude > 0.0):
        advice = "add a training motion that excites every master mode"
        raise InputError(
            "a mode was never excited in training", where=WHERE, value=chosen.trained_amplitude, advice=advice
        )
    return chosen


def interface_options(model: ReducedModel, settings: FmuSettings, info: FmuInfo) -> InterfaceOptions:
    """What the variables show beyond the model: ranges, absolute outputs, start values.

    Parameters
    ----------
    model : the whole model, all sensors.
    settings, info : of the export.

    Raises
    ------
    InputError : for ranges without 0, absolute outputs without motion of the base, shares that do not fit the sensors.
    """
    _check_ranges(model, info)
    share = None
    if settings.absolute:
        if BASE_ACCELERATION not in model.inputs:
            advice = "leave [fmu] absolute out, or give [base_acceleration] ([forcing.base_acceleration] for data)"
            raise InputError("absolute outputs need motion of the base", where="[fmu] absolute", advice=advice)
        given = info.base_share or (1.0,) * len(model.sensors)
        if len(given) != len(model.sensors):
            raise InputError("one share per sensor is needed", where="FmuInfo.base_share", value=given)
        names = model.sensors if settings.sensors is None else settings.sensors
        share = tuple(given[model.sensors.index(name)] for name in names)
    return InterfaceOptions(info.input_range, share, settings.start == "sensors", _in_file(settings))


def _check_ranges(model: ReducedModel, info: FmuInfo) -> None:
    if info.input_range and len(info.input_range) != len(model.inputs):
        raise InputError("one range per input is needed", where="FmuInfo.input_range", value=info.input_range)
    for name, (low, high) in zip(model.inputs, info.input_range, strict=False):
        if not (np.isfinite([low, high]).all() and low <= 0.0 <= high and low < high):
            advice = "inputs start at 0"
            raise InputError(f"the range of {name} must hold 0", where=WHERE, value=(low, high), advice=advice)


def _in_file(settings: FmuSettings) -> bool:
    """Whether coefficients are read from a file; left open, for several binaries, which then share one copy."""
    several = len(requested_platforms(settings.platforms)) > 1
    return settings.coefficients == "file" or (settings.coefficients == "auto" and several)


def _check_identifier(name: str) -> None:
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        advice = "use letters, digits and underscores, no digit first"
        raise InputError("the model name is no identifier", where=WHERE, value=name, advice=advice)


def _with_sensors(model: ReducedModel, names: tuple[str, ...]) -> ReducedModel:
    unknown = [name for name in names if name not in model.sensors]
    if unknown or not names:
        value = unknown[0] if unknown else "an empty list"
        advice = f"choose from {', '.join(model.sensors)}"
        raise InputError("unknown sensor", where="[fmu] sensors", value=value, advice=advice)
    rows = [model.sensors.index(name) for name in names]
    return dataclasses.replace(
        model,
        sensors=names,
        displacement=PolynomialMap(model.displacement.exponents, model.displacement.coefficients[rows]),
        velocity=PolynomialMap(model.velocity.exponents, model.velocity.coefficients[rows]),
    )
