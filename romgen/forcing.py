"""Loads on the reduced model: projection on the normal form and harmonic amplitudes.

Morsy, Xu, Tiso, Haller 2024, forced normal form z' = n(z) + B^-1 V^+ p(t).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.polynomial import PolynomialMap, jacobian, zeta
from romgen.reduced_model import ReducedModel


def input_matrix(
    inverse_chart: PolynomialMap[np.complex128], scale: FloatArray, modal_load: FloatArray
) -> ComplexArray:
    """Return G of z' = n(z) + G u(t) from the linear part of the inverse chart.

    eta'' = ... + modal_load u enters y' in its velocity half only, and z = H_lin (y / s) + ..., so

        G = H_lin diag(1 / s) [0; modal_load].

    Parameters
    ----------
    inverse_chart : H, m rows over the 2m variables y / s.
    scale : (2m,) s, units of y.
    modal_load : (m, n_input) Phi' f per unit input; of a base acceleration -Phi' M b (``base_acceleration_load``).

    Returns
    -------
    (m, n_input) complex, 1/s per input unit.

    Raises
    ------
    InputError : modal_load has not one row per master mode.

    Source: Morsy et al. 2024, the forced normal form, with the left eigenvectors as chart.
    """
    m = scale.size // 2
    if modal_load.ndim != 2 or modal_load.shape[0] != m:
        raise InputError(
            "the modal load needs one row per master mode",
            where="forcing",
            value=modal_load.shape,
            advice=f"pass an array of shape ({m}, n_input)",
        )
    return np.asarray(linear_part(inverse_chart)[:, m:] / scale[m:] @ modal_load, dtype=np.complex128)


def chart_input_matrix(model: ReducedModel, modal_load: FloatArray) -> ComplexArray:
    """Return G of a finished model from the linear part of its chart, as ``romgen.learn`` forms it.

    y / s = V z + conj(V z) + ..., so G = [V, conj V]^-1 [0; modal_load / s] in its first m rows.

    Parameters
    ----------
    modal_load : (m, n_input) of eta'' = ... + modal_load u, in the data's own normalisation of eta.

    Returns
    -------
    (m, n_input) complex, 1/s per input unit.

    Raises
    ------
    InputError : the linear part of the chart is singular.
    """
    m = model.eigenvalues.size
    first = linear_part(model.chart)
    V = 0.5 * (first[:, :m] + first[:, m:].conj())
    force = np.vstack([np.zeros_like(modal_load), modal_load]) / model.scale[:, None]
    try:
        return np.asarray(np.linalg.solve(np.hstack([V, V.conj()]), force)[:m], dtype=np.complex128)
    except np.linalg.LinAlgError as error:
        advice = "pass a model whose chart has displacement and velocity of every mode"
        raise InputError("the chart cannot be inverted", where=f"model {model.name}", advice=advice) from error


def with_inputs(
    model: ReducedModel, inputs: tuple[str, ...], units: tuple[str, ...], modal_load: FloatArray
) -> ReducedModel:
    """Return the model with load inputs, modal_load (m, n_input) as in ``chart_input_matrix``."""
    return replace(model, inputs=inputs, input_units=units, input_matrix=chart_input_matrix(model, modal_load))


def input_at_states(model: ReducedModel, z: ComplexArray, column: ComplexArray) -> ComplexArray:
    """Return how one input acts on z at states z (n, m): the exact counterpart of the constant G of the model.

    A load changes eta' alone: w = y / s has w' = ... + 2 Re(V G) u, V of the linear chart, and w = Re(T zeta^E) gives

        [dw/dz, dw/dconj(z)] (G(z), conj G(z)) = 2 Re(V G).

    The model keeps G(0) = G: the leading order in the amplitude.

    Parameters
    ----------
    column : (m,) G of the input.

    Returns
    -------
    (n, m) complex, 1/s per input unit.
    """
    m = z.shape[1]

    def slopes(at: ComplexArray) -> ComplexArray:
        T = jacobian(model.chart, zeta(at))
        return np.asarray(0.5 * (T + np.concatenate([T[..., m:], T[..., :m]], axis=-1).conj()))

    push = slopes(np.zeros((1, m), dtype=np.complex128))[0] @ np.concatenate([column, column.conj()])
    sides = np.broadcast_to(push[:, None], (len(z), 2 * m, 1))
    return np.asarray(np.linalg.solve(slopes(z), sides)[:, :m, 0])


def sensor_shapes(model: ReducedModel) -> FloatArray:
    """Return Phi (n_sensor, m): displacement of each sensor per eta_j at small amplitude (1 where eta is in m)."""
    m = model.eigenvalues.size
    real = linear_part(PolynomialMap(model.displacement.exponents, model.displacement.coefficients.astype(complex)))
    return np.asarray(real[:, :m].real / model.scale[:m])


def base_acceleration_load(shapes: FloatArray, mass_times_direction: FloatArray) -> FloatArray:
    """Return the modal load of a unit base acceleration, -Phi' M b.

    In coordinates relative to the base the rigid acceleration b a(t) acts as the force f = -M b a(t).

    Parameters
    ----------
    shapes : (n_dof, n_mode) M-normalised modes, 1/sqrt(kg).
    mass_times_direction : (n_dof,) M b, kg.

    Returns
    -------
    (n_mode, 1) sqrt(kg).
    """
    return np.asarray(-(shapes.T @ mass_times_direction)[:, None], dtype=np.float64)


def linear_part(polynomial: PolynomialMap[np.complex128]) -> ComplexArray:
    """Return the (n_out, n_var) matrix of the first-order terms of a polynomial map."""
    matrix = np.zeros((polynomial.coefficients.shape[0], polynomial.exponents.shape[1]), dtype=np.complex128)
    for k in np.flatnonzero(polynomial.exponents.sum(axis=1) == 1):
        matrix[:, int(np.argmax(polynomial.exponents[k]))] += polynomial.coefficients[:, k]
    return matrix


def harmonic_load(model: ReducedModel, name: str, level: float) -> ComplexArray:
    """Return the complex amplitude on exp(+i Omega t) of the load ``level`` cos(Omega t).

    level cos(Omega t) = level/2 (exp(i Omega t) + exp(-i Omega t)), so f = G level / 2.

    Parameters
    ----------
    name : one of ``model.inputs``.
    level : amplitude of the cosine, in the input's unit.

    Returns
    -------
    (m,) complex, 1/s.

    Raises
    ------
    InputError : the model has no such input.

    Source: Morsy et al. 2024 and the half amplitude of their released script.
    """
    if name not in model.inputs:
        raise InputError(
            "unknown load input",
            where=f"model {model.name}",
            value=name,
            advice=f"choose one of {', '.join(model.inputs) or 'none: the model has no inputs'}",
        )
    return np.asarray(0.5 * level * model.input_matrix[:, model.inputs.index(name)], dtype=np.complex128)
