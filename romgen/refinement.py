"""Refinement of a normal form on whole trajectories by variable projection and Levenberg-Marquardt.

The conjugacy cost weighs instantaneous derivatives; users see trajectories, where phase drift dominates. Unknowns are
the resonant coefficients B, small corrections of the eigenvalues, and one initial state per segment; several segments
per motion (multiple shooting, Bock 1981) keep the cost smooth until the frequencies are known, then one is left. The
displacement is a polynomial of z whose coefficients are eliminated, see ``output_map``. Velocities are not fitted: they
follow, and in measured data they carry the noise of differences and the fast modes.

The cost is the mean square misfit relative to the data, with Gaussian priors that weigh as much as a relative misfit
of PRIOR_ERROR when an unknown reaches its standard deviation. That of a coefficient is set at the corner of the data,
all modes at their largest amplitude at once: there it may change a rate by a few percent of the frequency, its own
damping by less. Terms that no motion excites strongly stay small, and so does the model between the motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.dissipation import penalty
from romgen.output_map import ProjectedRow, output_map, project, slopes
from romgen.refined_dynamics import RefinedDynamics, Segment, output_jacobian, segment_sensitivities, simulated
from romgen.resonance import ResonanceTable

PRIOR_ERROR = 0.002
# Standard deviations: of an eigenvalue as shares of Re and Im; of the rate that B adds at the corner as a share of the
# frequency, and of the part that is damping; of the displacement that C adds there as a share of the data.
PRIOR_REAL, PRIOR_IMAG = 0.01, 0.0005
PRIOR_RATE, PRIOR_DAMPING = 0.05, 0.005
PRIOR_OUTPUT = 0.1
MAX_REJECTIONS = 12
# Modal amplitudes of the data are at most 1/2; a trial that gets this far has blown up.
FAR = 10.0


@dataclass(frozen=True)
class _Evaluated:
    """A model with its motions, the eliminated displacement, and the cost; no rows where it is not finite."""

    model: RefinedDynamics
    segments: tuple[Segment, ...]
    z: ComplexArray
    rows: list[ProjectedRow]
    norm: float
    cost: float


@dataclass(frozen=True)
class _Linearised:
    model: RefinedDynamics
    hessian: FloatArray
    gradient: FloatArray


def refine(
    model: RefinedDynamics, segments: Sequence[Segment], max_step: float, steps: int, decrease: float
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """Return the model and segments after at most ``steps`` Levenberg-Marquardt steps.

    Parameters
    ----------
    model : start; segments : data and initial states.
    max_step : internal step of the simulation, s.
    decrease : relative decrease of the cost below which it has converged.
    """
    now = _evaluated(model, tuple(segments), max_step)
    if not np.isfinite(now.cost):
        return model, now.segments
    damping = 1e-3
    for _ in range(steps):
        here = _normal_equations(now, segment_sensitivities(now.model, now.segments, max_step))
        for _ in range(MAX_REJECTIONS):
            trial = _evaluated(*moved(here.model, now.segments, _step(here, damping)), max_step)
            if trial.cost < now.cost:
                break
            damping *= 8.0
        else:
            break
        gain = (now.cost - trial.cost) / now.cost
        now, damping = trial, max(damping / 8.0, 1e-9)
        if gain < decrease:
            break
    return _with_output(now), now.segments


def _step(here: _Linearised, damping: float) -> FloatArray:
    """Return the change of all unknowns; kept eigenvalues do not change."""
    H = here.hessian + damping * np.diag(np.maximum(np.diag(here.hessian), 1e-30))
    first = 2 * len(here.model.eigenvalues) if here.model.keep_linear else 0
    change = np.zeros(len(H))
    change[first:] = -np.linalg.solve(H[first:, first:], here.gradient[first:])
    return change


def replicates(
    model: RefinedDynamics, segments: Sequence[Segment], max_step: float, references: ComplexArray
) -> list[RefinedDynamics]:
    """Return the models of one Gauss-Newton step from the optimum with one block of samples left out each.

    Parameters
    ----------
    references : (n_segment * n_block, m) eigenvalues of the prior without each block; blocks are equal stretches of
        time of a segment.
    """
    blocks = len(references) // len(segments)
    segments = tuple(segments)
    z, W = np.vstack(simulated(model, segments, max_step)), segment_sensitivities(model, segments, max_step)
    models = []
    for number, segment in enumerate(segments):
        of = np.arange(len(segment.t)) * blocks // len(segment.t)
        for block in range(blocks):
            fewer = replace(segment, kept=segment.kept & (of != block))
            kept = (*segments[:number], fewer, *segments[number + 1 :])
            tied = replace(model, reference=references[number * blocks + block])
            here = _normal_equations(_projected(tied, kept, z), W)
            models.append(moved(model, kept, _step(here, 0.0))[0])
    return models


def regrown(model: RefinedDynamics, table: ResonanceTable) -> RefinedDynamics:
    """Return the model over the terms of a longer table, whose first rows are the old ones; new coefficients are 0."""
    more = ((0, 0), (0, len(table.exponents) - len(model.exponents)))
    output = output_map(model.output.linear, table)
    return replace(
        model,
        exponents=table.exponents,
        resonant=table.resonant,
        B=np.pad(model.B, more),
        output=output,
        C=np.pad(model.C, ((0, 0), (0, output.terms.shape[1] - model.C.shape[1]))),
        cost=float("inf"),
    )


def moved(
    model: RefinedDynamics, segments: tuple[Segment, ...], change: FloatArray
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """Return model and segments with ``change`` (n_unknown,) added: (Re, Im) pairs of Lambda and B, then the starts."""
    m = len(model.eigenvalues)
    rows, terms = np.nonzero(model.resonant)
    shared = 2 * (m + len(rows))
    delta = change[:shared:2] + 1j * change[1:shared:2]
    B = model.B.copy()
    B[rows, terms] += delta[m:]
    starts = change[shared:].reshape(len(segments), 2 * m)
    started = tuple(replace(s, z0=s.z0 + d[:m] + 1j * d[m:]) for s, d in zip(segments, starts, strict=True))
    return replace(model, eigenvalues=model.eigenvalues + delta[:m], B=B), started


def _prior(model: RefinedDynamics) -> tuple[FloatArray, FloatArray]:
    """Return weight and value of what is tied to zero, in (Re, Im) pairs: eigenvalue corrections, then B."""
    m = len(model.eigenvalues)
    rows, terms = np.nonzero(model.resonant)
    E, omega = model.exponents[terms], model.reference.imag
    corner = np.prod(np.concatenate([model.amplitude, model.amplitude]) ** E, axis=1) / model.amplitude[rows]
    own = (E[:, :m] - E[:, m:] == np.eye(m, dtype=np.int64)[rows]).all(axis=1)
    rate = corner / omega[rows]
    known = np.maximum(PRIOR_REAL * np.abs(model.reference.real), model.spread.real)
    real = np.concatenate([1.0 / known, rate / np.where(own, PRIOR_DAMPING, PRIOR_RATE)])
    known = np.maximum(PRIOR_IMAG * omega, model.spread.imag)
    imag = np.concatenate([1.0 / known, rate / PRIOR_RATE])
    values = np.concatenate([model.eigenvalues - model.reference, model.B[rows, terms]])
    weight = (PRIOR_ERROR * np.column_stack([real, imag]).ravel()) ** 2
    return weight, np.column_stack([values.real, values.imag]).ravel()


def growth(model: RefinedDynamics) -> tuple[float, FloatArray, FloatArray]:
    """Return the penalty on missing dissipation, half its gradient and its Gauss-Newton Hessian over Lambda and B."""
    return penalty(model.demand, model.exponents, model.resonant, (model.eigenvalues, model.B))


def _evaluated(model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float) -> _Evaluated:
    """Simulate and eliminate the displacement; cost inf where a segment blows up or a mode does not decay."""
    z = np.vstack(simulated(model, segments, max_step))
    with np.errstate(invalid="ignore", over="ignore"):
        if not np.abs(z).max() < FAR or np.any(model.eigenvalues.real >= 0):
            return _Evaluated(model, segments, z, [], 1.0, float("inf"))
    return _projected(model, segments, z)


def _projected(model: RefinedDynamics, segments: tuple[Segment, ...], z: ComplexArray) -> _Evaluated:
    share = _shares(segments)
    number = np.concatenate([np.full(len(s.t), s.motion) for s in segments])
    eta = np.vstack([s.eta for s in segments])
    norm = float(np.sum((share[:, None] * eta) ** 2))
    corner = np.prod(np.concatenate([model.amplitude, model.amplitude]) ** model.output.exponents, axis=1)
    # the data of the largest motion are 1 in the units of its share
    corner *= min(s.share for s in segments) * PRIOR_ERROR * np.sqrt(norm) / PRIOR_OUTPUT
    rows = project(model.output, z, (eta, share, number), corner)
    misfit = sum(float(row.residual @ row.residual) + row.penalty for row in rows) / norm
    weight, value = _prior(model)
    return _Evaluated(model, segments, z, rows, norm, misfit + float(weight @ value**2) + growth(model)[0])


def _shares(segments: tuple[Segment, ...]) -> FloatArray:
    """Return the weight of every sample, 0 where it is held out."""
    return np.concatenate([s.share * s.kept for s in segments])


def _with_output(now: _Evaluated) -> RefinedDynamics:
    """Return the model with the C and rest positions that were eliminated, and its cost."""
    C, rest = np.array([row.C for row in now.rows]), np.array([row.rest for row in now.rows]).T
    return replace(now.model, C=C, rest=rest, cost=now.cost)


def linearise(model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float) -> _Linearised:
    """Simulate all segments with sensitivities, eliminate C, and return cost, gradient and Gauss-Newton Hessian."""
    now = _evaluated(model, segments, max_step)
    return _normal_equations(now, segment_sensitivities(model, segments, max_step))


def _normal_equations(now: _Evaluated, W: list[ComplexArray]) -> _Linearised:
    """Return cost, gradient and Hessian for the motions and their sensitivities."""
    model = _with_output(now)
    s, share = slopes(model.output, model.C, now.z), _shares(now.segments)
    weight, value = _prior(model)
    _, slope, curvature = growth(model)
    shared, n = len(weight), len(weight) + 2 * len(model.eigenvalues) * len(W)
    hessian, gradient = np.zeros((n, n)), np.zeros(n)
    hessian[:shared, :shared] = np.diag(weight) + curvature
    gradient[:shared] = weight * value + slope
    for j, row in enumerate(now.rows):
        J = output_jacobian(share[:, None] * s[:, j], W)
        hessian += row.reduced(J) / now.norm
        gradient -= J.T @ row.residual / now.norm
    return _Linearised(model, hessian, gradient)
