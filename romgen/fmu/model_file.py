"""rom.json: a reduced model as readable text, complex numbers as [re, im]."""

from __future__ import annotations

import json
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.fmu.factored import factored_model
from romgen.fmu.programme import fold_conjugates
from romgen.fmu.tables import TABLE_FILE, TABLE_LAYOUT, table_bytes, with_table
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.stability import Stability

JSON_PATH, TABLE_PATH = "resources/rom.json", f"resources/{TABLE_FILE}"
FORMAT = "romgen reduced model 1"


def model_resources(model: ReducedModel, *, in_file: bool) -> dict[str, bytes]:
    """Files of a unit that hold its model, by path: rom.json alone, or with the large tables in coefficients.bin."""
    if not in_file:
        return {JSON_PATH: model_json(model).encode()}
    return {JSON_PATH: _text(_content(model, TABLE_FILE)).encode(), TABLE_PATH: table_bytes(factored_model(model))}


def model_in_unit(path: Path) -> ReducedModel | None:
    """The model that a unit holds, None where it holds none.

    Raises
    ------
    InputError : its files are no reduced model.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if JSON_PATH not in names:
                return None
            table = archive.read(TABLE_PATH) if TABLE_PATH in names else None
            text = archive.read(JSON_PATH).decode()
    except (zipfile.BadZipFile, zlib.error, UnicodeDecodeError) as error:
        raise InputError(f"is damaged ({error})", where=f"{path}: {JSON_PATH}") from error
    return model_from_json(text, table, where=f"{path}: {JSON_PATH}")


def model_json(model: ReducedModel) -> str:
    """All numbers of a model, one key of the top level per line; conjugate terms of the chart are folded into one."""
    return _text(_content(model))


def _content(model: ReducedModel, table: str | None = None) -> dict[str, object]:
    """The keys of rom.json; ``table`` names the file that holds the large tables instead."""
    return {
        "format": FORMAT,
        "name": model.name,
        "equations": "z' = Lambda z + N zeta^E + G u; y/s = Re(T zeta^E); x = W (y/s)^E; x' = W_v (y/s)^E; "
        "zeta = (z, conj z)",
        "eigenvalues_per_s": _pairs(model.eigenvalues),
        "normal_form": _map(model.normal_form),
        "chart": _map(fold_conjugates(model.chart), table),
        "inverse_chart": _map(model.inverse_chart),
        "scale": model.scale.tolist(),
        "displacement_m": _map(model.displacement, table),
        "velocity_m_per_s": _map(model.velocity, table),
        "sensors": list(model.sensors),
        "inputs": list(model.inputs),
        "input_units": list(model.input_units),
        "input_matrix": _pairs(model.input_matrix),
        "internal_resonance": list(model.internal_resonance),
        "trained_amplitude": model.trained_amplitude.tolist(),
        "trained_facets": model.trained_range.facets.tolist(),
        "stability": None if model.stability is None else _stability_content(model.stability),
    }


def _text(content: dict[str, object]) -> str:
    lines = [f"{json.dumps(key)}: {_compact(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _compact(value: object) -> str:
    return json.dumps(value, allow_nan=False, separators=(",", ":"))


def _map(p: PolynomialMap[np.float64] | PolynomialMap[np.complex128], table: str | None = None) -> dict[str, object]:
    if table is not None:
        return {"exponents": p.exponents.tolist(), "coefficients": table, "layout": TABLE_LAYOUT}
    is_complex = np.iscomplexobj(p.coefficients)
    return {
        "exponents": p.exponents.tolist(),
        "coefficients": _pairs(p.coefficients) if is_complex else p.coefficients.tolist(),
    }


def _pairs(values: ComplexArray | FloatArray) -> object:
    return np.stack([values.real, values.imag], axis=-1).tolist()


def model_from_json(text: str, table: bytes | None = None, where: str = "rom.json") -> ReducedModel:
    """The model that ``model_json`` wrote, exactly; the chart comes folded, which leaves its real part as it was.

    Parameters
    ----------
    text : content of rom.json.
    table : content of coefficients.bin, for a unit that has one.
    where : named in errors.

    Raises
    ------
    InputError : the text is no such model.
    """
    try:
        content = json.loads(text)
        if content["format"] != FORMAT:
            raise ValueError(f"format is '{content['format']}'")
        if table is not None and content["chart"].get("layout") != TABLE_LAYOUT:
            raise ValueError(f"{TABLE_FILE} was written by another version of romgen; export the unit again")
        if table is None and content["chart"]["coefficients"] == TABLE_FILE:
            raise ValueError(f"{TABLE_FILE} with its coefficients is missing")
        if table is None:
            return _model(content)
        for key, zero in (("chart", [0.0, 0.0]), ("displacement_m", 0.0), ("velocity_m_per_s", 0.0)):
            n_out = 2 * len(content["eigenvalues_per_s"]) if key == "chart" else len(content["sensors"])
            content[key]["coefficients"] = [[zero] * len(content[key]["exponents"])] * n_out
        return with_table(_model(content), table)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"is not a reduced model ({error})", where=where) from error


def _model(content: dict[str, Any]) -> ReducedModel:
    m, n_input = len(content["eigenvalues_per_s"]), len(content["inputs"])
    return ReducedModel(
        name=content["name"],
        eigenvalues=_complex(content["eigenvalues_per_s"], (m,)),
        normal_form=_complex_map(content["normal_form"], m, 2 * m),
        chart=_complex_map(content["chart"], 2 * m, 2 * m),
        inverse_chart=_complex_map(content["inverse_chart"], m, 2 * m),
        scale=np.array(content["scale"], dtype=np.float64),
        displacement=_real_map(content["displacement_m"], 2 * m),
        velocity=_real_map(content["velocity_m_per_s"], 2 * m),
        sensors=tuple(content["sensors"]),
        inputs=tuple(content["inputs"]),
        input_units=tuple(content["input_units"]),
        input_matrix=_complex(content["input_matrix"], (m, n_input)),
        internal_resonance=tuple(content["internal_resonance"]),
        trained_amplitude=np.array(content["trained_amplitude"], dtype=np.float64),
        trained_facets=_facets(content, m),
        stability=_stability(content),
    )


def _facets(content: dict[str, Any], m: int) -> FloatArray | None:
    """The facets of the trained range; None, the box of the amplitudes, for files written before there were any."""
    if "trained_facets" not in content:
        return None
    facets: FloatArray = np.array(content["trained_facets"], dtype=np.float64).reshape(-1, m)
    return facets


def _stability_content(tried: Stability) -> dict[str, object]:
    """JSON has no infinity: the rate of a motion that diverges is null."""
    return {
        "factor": tried.factor.tolist(),
        "share": tried.share.tolist(),
        "slowest_rate_per_s": [rate if math.isfinite(rate) else None for rate in tried.slowest_rate.tolist()],
        "linear_rate_per_s": tried.linear_rate,
        "starts": tried.starts,
    }


def _stability(content: dict[str, Any]) -> Stability | None:
    """The decays that were tried; None where none were, or for files written before there was such a test."""
    part = content.get("stability")
    if part is None:
        return None
    return Stability(
        factor=np.array(part["factor"], dtype=np.float64),
        share=np.array(part["share"], dtype=np.float64),
        slowest_rate=np.array([-math.inf if rate is None else rate for rate in part["slowest_rate_per_s"]]),
        linear_rate=float(part["linear_rate_per_s"]),
        starts=int(part["starts"]),
    )


def _complex(pairs: object, shape: tuple[int, ...]) -> ComplexArray:
    values = np.array(pairs, dtype=np.float64).reshape((*shape, 2))
    joined: ComplexArray = values[..., 0] + 1j * values[..., 1]
    return joined


def _complex_map(table: dict[str, Any], n_out: int, n_var: int) -> PolynomialMap[np.complex128]:
    exponents = np.array(table["exponents"], dtype=np.int64).reshape(-1, n_var)
    return PolynomialMap(exponents, _complex(table["coefficients"], (n_out, len(exponents))))


def _real_map(table: dict[str, Any], n_var: int) -> PolynomialMap[np.float64]:
    exponents = np.array(table["exponents"], dtype=np.int64).reshape(-1, n_var)
    return PolynomialMap(exponents, np.array(table["coefficients"], dtype=np.float64).reshape(-1, len(exponents)))
