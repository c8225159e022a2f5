"""The charts of a normal form that was refined on trajectories: displacement as fitted, velocity as its rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.normal_form import NormalFormFit, relative_error_percent
from romgen.output_map import OutputMap, slopes
from romgen.polynomial import PolynomialMap, evaluate, exponents, monomials, zeta
from romgen.reduced_dynamics import ReducedDynamics
from romgen.refined_dynamics import RefinedDynamics, Segment, simulated
from romgen.regression import ridge_fit
from romgen.resonance import ResonanceTable
from romgen.trained_range import trained_range


def refined_normal_form(
    dynamics: ReducedDynamics,
    model: RefinedDynamics,
    table: ResonanceTable,
    segments: Sequence[Segment],
    settings: tuple[float, float],
) -> NormalFormFit:
    """Return the refined model with its charts over the scaled coordinates w = (eta, eta') / s.

    The displacement is the fitted one without rest positions. The velocity is its rate along z' = n(z): the linear
    rate Lambda of every term exactly, what the nonlinear terms of n add by regression on the simulated motions. The
    inverse chart is regressed on the chart of the simulated motions.

    Parameters
    ----------
    segments : one per motion.
    settings : ridge of both regressions; internal step of the simulation, s.
    """
    ridge, max_step = settings
    m, scale = len(model.eigenvalues), dynamics.scale
    z = np.vstack([run[s.kept] for run, s in zip(simulated(model, segments, max_step), segments, strict=True)])
    E, eta = chart_terms(model.output, model.C)
    rate = velocity_rows(model, (E, eta), z, ridge)
    rows = np.vstack([eta, rate]).astype(np.complex128) / scale[:, None]
    chart = PolynomialMap(E, rows)
    w = evaluate(chart, zeta(z)).real
    inverse_terms = exponents(2 * m, 1, int(model.exponents.sum(axis=1).max()))
    H = ridge_fit(monomials(w, inverse_terms).astype(np.complex128), z, ridge)
    vectors: ComplexArray = 0.5 * rows[:, :m]
    inverse: ComplexArray = np.linalg.inv(np.hstack([vectors, vectors.conj()])).astype(np.complex128)[:m]
    seen = np.vstack([(s.eta - model.rest[s.motion])[s.kept] for s in segments]) / scale[:m]
    return NormalFormFit(
        dynamics=replace(
            dynamics,
            eigenvalues=model.eigenvalues,
            vectors=vectors,
            inverse=inverse,
        ),
        resonance=table,
        conjugacy=None,
        normal_form=PolynomialMap(model.exponents, model.B),
        chart=chart,
        inverse_chart=PolynomialMap(inverse_terms, H),
        trained_range=trained_range(z),
        chart_error_percent=relative_error_percent(seen, w[:, :m]),
    )


def chart_terms(output: OutputMap, C: ComplexArray) -> tuple[IntArray, ComplexArray]:
    """Return exponents, linear terms z_1..z_m first, and coefficients (m, n_term) of eta, linear part included."""
    rows = C.copy()
    m = len(output.linear)
    rows[:, :m] += np.diag(output.linear)
    return output.exponents, rows


def velocity_rows(
    model: RefinedDynamics, chart: tuple[IntArray, ComplexArray], z: ComplexArray, ridge: float
) -> ComplexArray:
    """Return coefficients (m, n_term) of eta' = d eta/dz n(z) over the exponents of the chart of eta."""
    E, eta = chart
    m = len(model.eigenvalues)
    rows: ComplexArray = eta * (E @ zeta(model.eigenvalues))
    added = evaluate(PolynomialMap(model.exponents, model.B), zeta(z))
    rate: FloatArray = np.einsum("tji,ti->tj", slopes(model.output, model.C, z), added).real
    nonlinear = E.sum(axis=1) > 1
    phi = monomials(zeta(z), E[nonlinear])
    own = (E[nonlinear, :m] == E[nonlinear, m:]).all(axis=1)
    c = ridge_fit(np.hstack([phi.real, -phi.imag[:, ~own]]), rate, ridge)
    fitted = c[:, : phi.shape[1]].astype(np.complex128)
    fitted[:, ~own] += 1j * c[:, phi.shape[1] :]
    rows[:, nonlinear] += fitted
    return rows
