"""rom.json: a reduced model as readable text, complex numbers as [re, im]."""

from __future__ import annotations

import json

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.fmu.programme import fold_conjugates
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel

FORMAT = "romgen reduced model 1"


def model_json(model: ReducedModel) -> str:
    """All numbers of a model, conjugate terms of the chart folded, one key of the top level per line, decimals that read back exactly."""
    content = {
        "format": FORMAT,
        "name": model.name,
        "equations": "z' = Lambda z + N zeta^E + G u; y/s = Re(T zeta^E); x = W (y/s)^E; x' = W_v (y/s)^E; "
        "zeta = (z, conj z)",
        "eigenvalues_per_s": _pairs(model.eigenvalues),
        "normal_form": _map(model.normal_form),
        "chart": _map(fold_conjugates(model.chart)),
        "inverse_chart": _map(model.inverse_chart),
        "scale": model.scale.tolist(),
        "displacement_m": _map(model.displacement),
        "velocity_m_per_s": _map(model.velocity),
        "sensors": list(model.sensors),
        "inputs": list(model.inputs),
        "input_units": list(model.input_units),
        "input_matrix": _pairs(model.input_matrix),
        "internal_resonance": list(model.internal_resonance),
        "trained_amplitude": model.trained_amplitude.tolist(),
    }
    lines = [f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _map(p: PolynomialMap[np.float64] | PolynomialMap[np.complex128]) -> dict[str, object]:
    is_complex = np.iscomplexobj(p.coefficients)
    return {
        "exponents": p.exponents.tolist(),
        "coefficients": _pairs(p.coefficients) if is_complex else p.coefficients.tolist(),
    }


def _pairs(values: ComplexArray | FloatArray) -> object:
    return np.stack([values.real, values.imag], axis=-1).tolist()
