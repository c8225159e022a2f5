"""The reduced model against the finite-element model under any function of time of a load input, both from rest."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.forced_motion import Amplitude, ForcedMotion
from romgen.metrics import nmte_percent
from romgen.reduced_model import ReducedModel
from romgen.settings import LoadHistorySettings
from romgen.simulate import sensors, simulate

SAMPLES = 64
"""Least samples of the load per period of the fastest master mode; linear between, they miss 1e-3 of it there."""


@dataclass(frozen=True)
class HistoryComparison:
    """One load history in both models.

    Attributes
    ----------
    input, unit : the load input.
    nmte_percent : of all sensors together; rom_peak_m, fe_peak_m : largest displacement of any sensor.
    range_share : largest abs(z_j) over that in training; above 1 the model extrapolates.
    t : (n_time,) s; load : (n_time,); rom, fe : (n_time, n_sensor) m.
    """

    name: str
    input: str
    unit: str
    sensors: tuple[str, ...]
    nmte_percent: float
    rom_peak_m: float
    fe_peak_m: float
    range_share: float
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    load: FloatArray = field(metadata={"unit": "input", "axes": "time"})
    rom: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    fe: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})


@dataclass(frozen=True)
class LoadHistories:
    """All load histories, in the order of the study."""

    histories: tuple[HistoryComparison, ...]


@dataclass(frozen=True)
class LoadSamples:
    """Times (n,) s and values (n,) of a load; linear between them, 0 before and after."""

    times: FloatArray
    values: FloatArray

    def at(self, t: FloatArray | float) -> FloatArray:
        """The load at t."""
        return np.asarray(np.interp(t, self.times, self.values, left=0.0, right=0.0))


def load_samples(name: str, table: LoadHistorySettings) -> LoadSamples:
    """The samples of a table, from the study or from its CSV file: two columns, time and value, a header or none.

    Raises
    ------
    InputError : a file that cannot be read, times that do not increase, numbers that are not finite.
    """
    where = f"[load_histories.{name}]"
    if table.file is None:
        times, values = np.array(table.times), np.array(table.values)
    else:
        times, values = _read(table.file, where)
    if len(times) < 2 or np.any(np.diff(times) <= 0.0) or not np.isfinite(values).all():
        advice = "give at least two increasing times and finite values"
        raise InputError("not a load history", where=where, advice=advice)
    return LoadSamples(times, table.scale * values)


def _read(path: Path, where: str) -> tuple[FloatArray, FloatArray]:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("cannot read the load history", where=where, value=str(path)) from error
    rows = []
    for number, line in enumerate(lines, 1):
        cells = _cells(line)
        try:
            time, value = map(float, cells)
        except ValueError as error:
            if not line.strip() or (number == 1 and not any(map(_is_number, cells))):  # a header
                continue
            advice = "write two columns, time and value, separated by a comma"
            raise InputError(
                f"line {number} of {path.name} is no sample", where=where, value=line, advice=advice
            ) from error
        rows.append((time, value))
    table = np.array(rows).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _cells(line: str) -> list[str]:
    """Parted by semicolons or tabs, with decimal points or commas, or by commas."""
    separator = next((mark for mark in (";", "\t") if mark in line), ",")
    return [cell if separator == "," else cell.replace(",", ".") for cell in line.split(separator)]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def history_motion(tables: dict[str, LoadHistorySettings], n_dof: int, step: float) -> ForcedMotion:
    """All histories side by side from rest, for as long as the longest lasts.

    Parameters
    ----------
    step : s, of the march.
    """
    still = np.zeros((n_dof, len(tables)))
    samples = [load_samples(name, table) for name, table in tables.items()]
    inputs = [table.input for table in tables.values()]
    loads = {name: _of_input(name, inputs, samples) for name in dict.fromkeys(inputs)}
    n_step = max(round(_duration(table, each) / step) for table, each in zip(tables.values(), samples, strict=True))
    return ForcedMotion(still, still, loads, n_step)


def _of_input(name: str, inputs: list[str], samples: list[LoadSamples]) -> Amplitude:
    """The load on one input of all cases, 0 in those that another input drives."""

    def at(t: float) -> FloatArray:
        return np.array(
            [float(each.at(t)) if other == name else 0.0 for other, each in zip(inputs, samples, strict=True)]
        )

    return at


def _duration(table: LoadHistorySettings, samples: LoadSamples) -> float:
    return float(samples.times[-1]) if table.duration is None else table.duration


def compare_history(
    model: ReducedModel, name: str, table: LoadHistorySettings, t: FloatArray, fe: FloatArray
) -> HistoryComparison:
    """Run the reduced model under the same load and compare all sensors over the duration of this history.

    Parameters
    ----------
    t : (n_time,) s; fe : (n_time, n_sensor) m, of the finite-element march.
    """
    samples = load_samples(name, table)
    kept = t <= _duration(table, samples) + 0.5 * (t[1] - t[0])
    t, fe = t[kept], fe[kept]
    # The finite-element march samples the load at its steps; a finer grid here keeps corners between them.
    count = max(len(t), int(np.ceil(t[-1] * SAMPLES * np.abs(model.eigenvalues.imag).max() / (2.0 * np.pi))))
    fine = np.union1d(t, np.linspace(t[0], t[-1], count))
    u = np.zeros((len(fine), len(model.inputs)))
    u[:, model.inputs.index(table.input)] = samples.at(fine)
    z = simulate(model, fine, np.zeros(len(model.eigenvalues), dtype=np.complex128), u)[np.searchsorted(fine, t)]
    rom = sensors(model, z)[0]
    return HistoryComparison(
        name=name,
        input=table.input,
        unit=model.input_units[model.inputs.index(table.input)],
        sensors=model.sensors,
        nmte_percent=nmte_percent(fe, rom),
        rom_peak_m=float(np.abs(rom).max()),
        fe_peak_m=float(np.abs(fe).max()),
        range_share=float((np.abs(z) / model.trained_amplitude).max()),
        t=t,
        load=samples.at(t),
        rom=rom,
        fe=fe,
    )
