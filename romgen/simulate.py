"""Simulation of a reduced model under arbitrary inputs, and its sensors."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError, NumericalError
from romgen.etdrk4 import largest_step, march
from romgen.polynomial import evaluate, zeta
from romgen.reduced_model import ReducedModel

Hold = Literal["constant", "linear"]
BLOW_UP = 1e3


def simulate(
    model: ReducedModel,
    t: FloatArray,
    z0: ComplexArray,
    u: FloatArray | None = None,
    hold: Hold = "linear",
    max_step: float | None = None,
) -> ComplexArray:
    """Integrate z' = Lambda z + N zeta^E + G u(t) by ETDRK4, the algorithm of the FMU.

    Parameters
    ----------
    t : (n_time,) s, increasing.
    z0 : (m,) state at t[0].
    u : (n_time, n_input) samples of the inputs at t, or None without load.
    hold : u between samples: held, or piecewise linear.
    max_step : largest internal step in s, default ``largest_step``.

    Returns
    -------
    (n_time, m) z.

    Raises
    ------
    InputError : shapes or times that do not fit.
    NumericalError : the state left all bounds.
    """
    start, rise = _modal_inputs(model, t, u, hold)
    step = largest_step(model.eigenvalues) if max_step is None else max_step
    nf = model.normal_form
    z = march(t, z0.astype(np.complex128), model.eigenvalues, nf.exponents, nf.coefficients, start, rise, step)
    finite = np.isfinite(z).all(axis=1)
    if not finite.all():
        raise NumericalError(
            "the reduced model diverged",
            where=model.name,
            value=f"first non-finite state at t = {t[np.argmin(finite)]:.6g} s, start abs(z) = {np.abs(z0)}",
            advice=f"stay near the trained amplitudes abs(z) <= {model.trained_amplitude}",
        )
    return z


def free_motion(model: ReducedModel, t: FloatArray, z0: ComplexArray) -> ComplexArray:
    """Integrate without input as ``simulate``, but return nan from where a state leaves all bounds.

    Bounds are BLOW_UP times the trained amplitude; a model that gets there has no meaning left.
    """
    start, rise = _modal_inputs(model, t, None, "constant")
    nf, step = model.normal_form, largest_step(model.eigenvalues)
    z = march(t, z0.astype(np.complex128), model.eigenvalues, nf.exponents, nf.coefficients, start, rise, step)
    with np.errstate(invalid="ignore", over="ignore"):
        lost = ~(np.abs(z) <= BLOW_UP * model.trained_amplitude.max()).all(axis=1)
    if lost.any():
        z[int(lost.argmax()) :] = np.nan
    return z


def simulate_reference(
    model: ReducedModel,
    t: FloatArray,
    z0: ComplexArray,
    u: FloatArray | None = None,
    hold: Hold = "linear",
    rtol: float = 1e-10,
) -> ComplexArray:
    """Integrate as ``simulate`` but by DOP853 with relative tolerance ``rtol``, restarted at every input sample."""
    start, rise = _modal_inputs(model, t, u, hold)
    atol = rtol * max(1e-3, float(np.abs(z0).max()))

    def rate(time: float, z: ComplexArray, k: int, width: float) -> ComplexArray:
        force = start[k] + rise[k] * ((time - t[k]) / width)
        total: ComplexArray = model.eigenvalues * z + evaluate(model.normal_form, zeta(z[None]))[0] + force
        return total

    def solve(t_eval: FloatArray, z: ComplexArray, k: int) -> ComplexArray:
        span = (float(t_eval[0]), float(t_eval[-1]))
        out = solve_ivp(rate, span, z, "DOP853", t_eval, rtol=rtol, atol=atol, args=(k, span[1] - span[0]))
        if not out.success:
            raise NumericalError("DOP853 stopped", where=model.name, value=out.message)
        return np.asarray(out.y.T)

    z0 = z0.astype(np.complex128)
    if u is None:
        return solve(t, z0, 0)
    history = [z0]
    for k in range(len(t) - 1):
        history.append(solve(t[k : k + 2], history[-1], k)[-1])
    return np.array(history)


def _modal_inputs(
    model: ReducedModel, t: FloatArray, u: FloatArray | None, hold: Hold
) -> tuple[ComplexArray, ComplexArray]:
    """Return G u at the start of each interval and its change over it, (n_time - 1, m)."""
    if t.ndim != 1 or np.any(np.diff(t) <= 0):
        raise InputError("times must increase", where="simulate t", value=f"shape {t.shape}")
    if u is None:
        nothing = np.zeros((len(t) - 1, len(model.eigenvalues)), dtype=np.complex128)
        return nothing, nothing
    if u.shape != (len(t), len(model.inputs)):
        raise InputError(
            "input samples do not fit", where="simulate u", value=u.shape, advice=f"give {(len(t), len(model.inputs))}"
        )
    g: ComplexArray = u @ model.input_matrix.T
    rise = np.diff(g, axis=0) if hold == "linear" else np.zeros_like(g[1:])
    return g[:-1].copy(), rise


def coordinates(model: ReducedModel, z: ComplexArray) -> FloatArray:
    """Return y = s Re(T zeta^E), (n_time, 2m) in m, m/s or modal units, of z (n_time, m)."""
    y: FloatArray = evaluate(model.chart, zeta(z)).real * model.scale
    return y


def sensors(model: ReducedModel, z: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return sensor displacement (m) and velocity (m/s), each (n_time, n_sensor), of z (n_time, m)."""
    w = evaluate(model.chart, zeta(z)).real
    return evaluate(model.displacement, w), evaluate(model.velocity, w)
