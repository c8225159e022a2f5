"""The large coefficient tables of a unit: one array of 64-bit words, compiled in or in resources/coefficients.bin."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from romgen.arrays import IntArray
from romgen.fmu.programme import MonomialProgramme, complex_programme, fold_conjugates, monomial_programme
from romgen.polynomial import PolynomialMap, Scalar
from romgen.reduced_model import ReducedModel

TABLE_FILE = "coefficients.bin"
TABLE_LAYOUT = 2
"""Order of the numbers in it; grows when it changes, so that no older file is misread."""

FNV_OFFSET, FNV_PRIME = 14695981039346656037, 1099511628211
"""Fowler, Noll and Vo's hash with 64 bits, here of words instead of bytes."""


def table_bytes(model: ReducedModel) -> bytes:
    """Struct ``rom_tables`` of the C runtime as little-endian doubles: normal form, chart, sensors.

    The normal form holds its nonzero terms row by row as (re, im), one zero where there is none; the chart a row per
    monomial of its programme, the sensors a row per sensor.
    """
    chart = fold_conjugates(model.chart)
    dense = dense_coefficients(complex_programme(chart.exponents), chart.exponents, chart.coefficients)
    programme = sensor_programme(model)
    sensors = np.vstack([dense_coefficients(programme, p.exponents, p.coefficients) for p in _sensor_maps(model)])
    form = model.normal_form.coefficients
    terms = form[form != 0] if np.any(form) else np.zeros(1, dtype=np.complex128)
    parts = (terms.view(np.float64), dense.real.T, dense.imag.T, sensors)
    return np.concatenate([part.ravel() for part in parts]).astype("<f8").tobytes()


def table_hash(table: bytes) -> int:
    """What the runtime compares the words of a table with."""
    value = FNV_OFFSET
    for word in np.frombuffer(table, dtype="<u8").tolist():
        value = (value ^ word) * FNV_PRIME % 2**64
    return value


def with_table(model: ReducedModel, table: bytes) -> ReducedModel:
    """The model with the coefficients of chart and sensors taken from a table; its exponents say where they are.

    Raises
    ------
    ValueError : for a table of another size.
    """
    words = np.frombuffer(table, dtype="<f8").astype(np.float64)
    n_form = 2 * max(1, int(np.count_nonzero(model.normal_form.coefficients)))
    chart, sensors = complex_programme(model.chart.exponents), sensor_programme(model)
    n_chart, n_reduced = chart.n_monomial * chart.n_var, chart.n_var
    n_sensor = sensors.n_monomial * 2 * len(model.sensors)
    if len(words) != n_form + 2 * n_chart + n_sensor:
        raise ValueError(f"{TABLE_FILE} has {len(words)} numbers, the model {n_form + 2 * n_chart + n_sensor}")
    re, im, rows = np.split(words[n_form:], [n_chart, 2 * n_chart])
    dense_chart = (re + 1j * im).reshape(chart.n_monomial, n_reduced).T
    dense = rows.reshape(2 * len(model.sensors), sensors.n_monomial)
    n = len(model.sensors)
    return dataclasses.replace(
        model,
        chart=_picked(chart, model.chart, dense_chart),
        displacement=_picked(sensors, model.displacement, dense[:n]),
        velocity=_picked(sensors, model.velocity, dense[n:]),
    )


def sensor_programme(model: ReducedModel) -> MonomialProgramme:
    """The monomials of displacements and velocities together."""
    return monomial_programme(np.vstack([p.exponents for p in _sensor_maps(model)]))


def dense_coefficients(
    programme: MonomialProgramme, exponents: IntArray, coefficients: npt.NDArray[Scalar]
) -> npt.NDArray[Scalar]:
    """Coefficients over every monomial of the programme, (n_out, n_monomial)."""
    dense = np.zeros((coefficients.shape[0], programme.n_monomial), dtype=coefficients.dtype)
    for k, position in enumerate(_positions(programme, exponents)):
        dense[:, position] += coefficients[:, k]
    return dense


def _picked(
    programme: MonomialProgramme, p: PolynomialMap[Scalar], dense: npt.NDArray[Scalar]
) -> PolynomialMap[Scalar]:
    return PolynomialMap(p.exponents, dense[:, _positions(programme, p.exponents)])


def _positions(programme: MonomialProgramme, exponents: IntArray) -> list[int]:
    return [programme.index[tuple(int(e) for e in row)] for row in exponents]


def _sensor_maps(model: ReducedModel) -> tuple[PolynomialMap[np.float64], PolynomialMap[np.float64]]:
    return model.displacement, model.velocity
