"""The large coefficient tables of a unit: one array of 64-bit words, compiled in or in resources/coefficients.bin."""

from __future__ import annotations

import dataclasses

import numpy as np

from romgen.arrays import FloatArray, IntArray
from romgen.fmu.factored import FactoredModel, factored_model
from romgen.fmu.real_chart import complex_chart
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel

TABLE_FILE = "coefficients.bin"
TABLE_LAYOUT = 3
"""Order of the numbers in it; grows when it changes, so that no older file is misread."""

FNV_OFFSET, FNV_PRIME = 14695981039346656037, 1099511628211
"""Fowler, Noll and Vo's hash with 64 bits, here of words instead of bytes."""


def table_bytes(factored: FactoredModel) -> bytes:
    """Struct ``rom_tables`` of the C runtime as little-endian doubles: normal form, chart, sensors.

    The normal form holds its terms group by group as (re, im), one zero where there is none; chart, displacements and
    velocities come in the order of ``HalvedMap.packed``.
    """
    terms = factored.form.coefficients if len(factored.form.coefficients) else np.zeros(1, dtype=np.complex128)
    chart = factored.chart.packed(factored.chart_map.coefficients)
    sensors = [factored.sensor.packed(rows) for rows in np.split(factored.sensor_map.coefficients, 2)]
    return np.concatenate([terms.view(np.float64), chart, *sensors]).astype("<f8").tobytes()


def table_hash(table: bytes) -> int:
    """What the runtime compares the words of a table with."""
    value = FNV_OFFSET
    for word in np.frombuffer(table, dtype="<u8").tolist():
        value = (value ^ word) * FNV_PRIME % 2**64
    return value


def with_table(model: ReducedModel, table: bytes) -> ReducedModel:
    """The model with the coefficients of chart and sensors taken from a table; its exponents say where they are.

    The sensors come back exactly, the chart, which is real there (``romgen.fmu.real_chart``), to rounding.

    Raises
    ------
    ValueError : for a table of another size.
    """
    words = np.frombuffer(table, dtype="<f8").astype(np.float64)
    factored, n_reduced, n_sensor = factored_model(model), len(model.scale), len(model.sensors)
    n_form, n_chart = 2 * max(1, len(factored.form.coefficients)), n_reduced * factored.chart.n_entry
    n_kind = n_sensor * factored.sensor.n_entry
    if len(words) != n_form + n_chart + 2 * n_kind:
        raise ValueError(f"{TABLE_FILE} has {len(words)} numbers, the model {n_form + n_chart + 2 * n_kind}")
    _, chart, *kinds = np.split(words, np.cumsum([n_form, n_chart, n_kind]))
    real = PolynomialMap(factored.chart_map.exponents, factored.chart.unpacked(chart, n_reduced))
    displacement, velocity = (factored.sensor.unpacked(kind, n_sensor) for kind in kinds)
    return dataclasses.replace(
        model,
        chart=complex_chart(real, model.chart.exponents),
        displacement=_picked(displacement, factored.sensor_map.exponents, model.displacement),
        velocity=_picked(velocity, factored.sensor_map.exponents, model.velocity),
    )


def _picked(W: FloatArray, exponents: IntArray, p: PolynomialMap[np.float64]) -> PolynomialMap[np.float64]:
    """The columns of W over some exponents that a map with fewer of them has."""
    column = {tuple(row): k for k, row in enumerate(exponents.tolist())}
    return PolynomialMap(p.exponents, W[:, [column[tuple(row)] for row in p.exponents.tolist()]])
