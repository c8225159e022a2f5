"""The generated C headers: sizes and coefficients of one model."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.etdrk4 import largest_step
from romgen.fmu.factored import N_GROUP, N_LANE, FactoredModel, GroupedForm
from romgen.fmu.magnitudes import nominal_displacement, nominal_velocity
from romgen.fmu.programme import MonomialProgramme
from romgen.fmu.records import PLAIN, InterfaceOptions
from romgen.fmu.tables import table_hash
from romgen.reduced_model import ReducedModel

HARD_LIMIT = 3.0
"""Default of the parameter hard_limit, in distances of the trained range (``romgen.trained_range``)."""


def coefficients_header(model: ReducedModel, factored: FactoredModel, options: InterfaceOptions = PLAIN) -> str:
    """The text of coefficients.h: small constant data only, decimal numbers that read back exactly."""
    return "\n".join(
        [
            f"/* Coefficients of the reduced model {model.name}; generated, data only. */",
            "#ifndef COEFFICIENTS_H",
            "#define COEFFICIENTS_H",
            "",
            '#include "rom_kernel.h"',
            "",
            _array("rom_complex eigenvalue[N_MODE]", map(_complex, model.eigenvalues)),
            _array("double trained_amplitude[N_MODE]", map(_real, model.trained_amplitude)),
            _array("double trained_facet[N_FACET][N_MODE]", map(_real_row, model.trained_range.facets)),
            _array("rom_complex input_matrix[ROM_AT_LEAST_ONE(N_INPUT)][N_MODE]", _input_rows(model.input_matrix)),
            _products("half", factored.half),
            _products("base", factored.form.base),
            _groups(factored.form),
            _array("unsigned short chart_count[N_CHART_BLOCK]", map(str, factored.chart.count)),
            _array("unsigned short sensor_count[N_SENSOR_BLOCK]", map(str, factored.sensor.count)),
            _array("double base_share[N_SENSOR]", map(_real, options.base_share or (0.0,) * len(model.sensors))),
            _array("double sensor_size[2]", map(_real, _sensor_sizes(model))),
            "#endif",
            "",
        ]
    )


def tables_header(table: bytes) -> str:
    """The text of tables.h: the large tables as one array, for units that read no file."""
    words = np.frombuffer(table, dtype="<f8")
    text = _array(f"double embedded_table[{len(words)}]", map(_real, words))
    return "\n".join(["/* The large tables of the reduced model in the order of rom_tables; generated. */", text])


def sizes_header(
    model: ReducedModel,
    factored: FactoredModel,
    guid: str,
    data: tuple[str, bytes],
    options: InterfaceOptions = PLAIN,
) -> str:
    """The text of model_sizes.h: identity and sizes of the model; ``data`` is coefficients.h and the large tables."""
    content_hash = hashlib.sha256(data[0].encode() + data[1]).hexdigest()
    half, form, chart, sensor = factored.half, factored.form, factored.chart, factored.sensor
    sizes = {
        "N_MODE": len(model.eigenvalues),
        "N_FACET": len(model.trained_range.facets),
        "N_INPUT": len(model.inputs),
        "N_SENSOR": len(model.sensors),
        "ABSOLUTE_OUTPUTS": int(options.base_share is not None),
        "START_FROM_SENSORS": int(options.start_from_sensors),
        "N_LANE": N_LANE,
        "N_GROUP": N_GROUP,
        "N_HALF_PRODUCT": len(half.products),
        "N_BASE_PRODUCT": len(form.base.products),
        "N_FORM_GROUP": sum(map(len, form.rows)),
        "N_FORM_TERM": len(form.coefficients),
        "N_FORM_PRODUCT": form.n_product,
        "N_CHART_PRODUCT": chart.n_product,
        "N_CHART_BLOCK": len(chart.count),
        "N_CHART_ENTRY": chart.n_entry,
        "N_SENSOR_PRODUCT": sensor.n_product,
        "N_SENSOR_BLOCK": len(sensor.count),
        "N_SENSOR_ENTRY": sensor.n_entry,
        "DEFAULT_HARD_LIMIT": _real(HARD_LIMIT),
        "DEFAULT_MAX_INTERNAL_STEP": _real(largest_step(model.eigenvalues)),
        "MODEL_IDENTIFIER": model.name,
        "MODEL_GUID": f'"{guid}"',
        "MODEL_HASH": f"UINT64_C(0x{content_hash[:16]})",
        "COEFFICIENTS_IN_FILE": int(options.coefficients_in_file),
        "TABLE_HASH": f"UINT64_C(0x{table_hash(data[1]):016x})",
    }
    lines = [f"#define {name} {value}" for name, value in sizes.items()]
    head = f"/* Identity and sizes of the reduced model {model.name}; generated. */"
    return "\n".join([head, "#ifndef MODEL_SIZES_H", "#define MODEL_SIZES_H", "", *lines, "", "#endif", ""])


def _sensor_sizes(model: ReducedModel) -> tuple[float, float]:
    """Largest displacement (m) and velocity (m/s) of any sensor in the trained range, 1 where nothing moves."""
    return float(np.max(nominal_displacement(model))) or 1.0, float(np.max(nominal_velocity(model))) or 1.0


def _products(name: str, programme: MonomialProgramme) -> str:
    items = [f"{{{left}, {right}}}" for left, right in programme.products] or ["{0, 0}"]
    return _array(f"rom_product {name}_product[ROM_AT_LEAST_ONE(N_{name.upper()}_PRODUCT)]", items)


def _groups(form: GroupedForm) -> str:
    """Where the groups of each row begin, and all groups."""
    starts = np.cumsum([0, *map(len, form.rows)])
    groups = [f"{{{base}, {count}}}" for row in form.rows for base, count in row]
    return "\n".join(
        [
            _array("unsigned form_row[N_MODE + 1]", map(str, starts)),
            _array("rom_group form_group[ROM_AT_LEAST_ONE(N_FORM_GROUP)]", groups or ["{0, 0}"]),
        ]
    )


def _array(declaration: str, items: Iterable[str]) -> str:
    lines, line = [], "   "
    for item in items:
        if len(line) + len(item) > 116:
            lines.append(line)
            line = "   "
        line += f" {item},"
    return "\n".join([f"static const {declaration} = {{", *lines, line, "};", ""])


def _input_rows(matrix: ComplexArray) -> Sequence[str]:
    rows = ["{" + ", ".join(map(_complex, column)) + "}" for column in matrix.T]
    return rows or ["{" + ", ".join([_complex(0j)] * len(matrix)) + "}"]


def _complex(value: complex) -> str:
    return f"{{{_real(value.real)}, {_real(value.imag)}}}"


def _real_row(values: FloatArray) -> str:
    return "{" + ", ".join(map(_real, values)) + "}"


def _real(value: float) -> str:
    return repr(float(value))
