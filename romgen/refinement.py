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
from dataclasses import dataclass, field, replace

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.dissipation import Demand, penalty
from romgen.etdrk4 import march
from romgen.output_map import OutputMap, ProjectedRow, output_map, project, slopes
from romgen.resonance import ResonanceTable
from romgen.variational import sensitivities

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
class Segment:
    """A stretch of a motion with its own initial state.

    Attributes
    ----------
    t : (n_time,) s.
    eta : (n_time, m) modal displacement of the data.
    z0 : (m,) initial state of the model.
    kept : (n_time,) samples that count; the others are held out.
    motion : number of the motion it belongs to.
    share : weight of a sample, one over the largest norm of eta of the motion, as in the NMTE.
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    eta: FloatArray = field(metadata={"unit": "unit of eta", "axes": "time,mode"})
    z0: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})
    kept: BoolArray = field(metadata={"unit": "1", "axes": "time"})
    motion: int
    share: float


@dataclass(frozen=True)
class RefinedDynamics:
    """Normal form and displacement map during refinement.

    Attributes
    ----------
    eigenvalues : (m,) Lambda, 1/s; reference : (m,) the values they are tied to; keep_linear : they stay there.
    amplitude : (m,) corner of the data, largest abs(z_j) over all motions.
    exponents : (n_term, 2m) degree >= 2; resonant : (m, n_term) terms of B; B : (m, n_term) 1/s.
    output : terms of the displacement; C : (m, n_output) their coefficients; rest : (n_motion, m) rest positions.
    cost : relative mean square misfit with priors and penalty.
    demand : where dissipation is demanded; None demands none.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    reference: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    amplitude: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    resonant: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode,term"})
    output: OutputMap
    C: ComplexArray = field(metadata={"unit": "unit of eta", "axes": "mode,term"})
    rest: FloatArray = field(metadata={"unit": "unit of eta", "axes": "motion,mode"})
    cost: float = float("inf")
    keep_linear: bool = False
    demand: Demand | None = None


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
    segments = tuple(segments)
    if not np.isfinite(_cost(model, segments, max_step)):
        return model, segments
    here = linearise(model, segments, max_step)
    damping = 1e-3
    for _ in range(steps):
        for _ in range(MAX_REJECTIONS):
            change = _step(here, damping)
            trial_model, trial_segments = moved(here.model, segments, change)
            cost = _cost(trial_model, trial_segments, max_step)
            if cost < here.model.cost:
                break
            damping *= 8.0
        else:
            break
        gain = (here.model.cost - cost) / here.model.cost
        segments, damping = trial_segments, max(damping / 8.0, 1e-9)
        here = linearise(trial_model, segments, max_step)
        if gain < decrease:
            break
    return here.model, segments


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
    motion = _sensitivities(model, segments, max_step)
    models = []
    for number, segment in enumerate(segments):
        of = np.arange(len(segment.t)) * blocks // len(segment.t)
        for block in range(blocks):
            fewer = replace(segment, kept=segment.kept & (of != block))
            kept = (*segments[:number], fewer, *segments[number + 1 :])
            tied = replace(model, reference=references[number * blocks + block])
            here = _normal_equations(tied, kept, motion)
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


def simulated(model: RefinedDynamics, segments: Sequence[Segment], max_step: float) -> list[ComplexArray]:
    """Return z (n_time, m) of each segment from its initial state; not finite where it blows up."""
    kept = model.resonant.any(axis=0)
    E, B = model.exponents[kept], model.B[:, kept]
    runs = []
    for s in segments:
        still = np.zeros((len(s.t) - 1, len(s.z0)), dtype=np.complex128)
        runs.append(march(s.t, s.z0, model.eigenvalues, E, B, still, still, max_step))
    return runs


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
    real = np.concatenate([1.0 / (PRIOR_REAL * model.reference.real), rate / np.where(own, PRIOR_DAMPING, PRIOR_RATE)])
    imag = np.concatenate([1.0 / (PRIOR_IMAG * omega), rate / PRIOR_RATE])
    values = np.concatenate([model.eigenvalues - model.reference, model.B[rows, terms]])
    weight = (PRIOR_ERROR * np.column_stack([real, imag]).ravel()) ** 2
    return weight, np.column_stack([values.real, values.imag]).ravel()


def growth(model: RefinedDynamics) -> tuple[float, FloatArray, FloatArray]:
    """Return the penalty on missing dissipation, half its gradient and its Gauss-Newton Hessian over Lambda and B."""
    return penalty(model.demand, model.exponents, model.resonant, (model.eigenvalues, model.B))


def _projected(
    model: RefinedDynamics, z: ComplexArray, segments: tuple[Segment, ...]
) -> tuple[list[ProjectedRow], FloatArray, float]:
    """Return the rows of the displacement, the weight of each sample and the weighted sum of squares of the data."""
    share = np.concatenate([s.share * s.kept for s in segments])
    motion = np.concatenate([np.full(len(s.t), s.motion) for s in segments])
    eta = np.vstack([s.eta for s in segments])
    norm = float(np.sum((share[:, None] * eta) ** 2))
    corner = np.prod(np.concatenate([model.amplitude, model.amplitude]) ** model.output.exponents, axis=1)
    # the data of the largest motion are 1 in the units of its share
    corner *= min(s.share for s in segments) * PRIOR_ERROR * np.sqrt(norm) / PRIOR_OUTPUT
    rows = [project(model.output, z, (eta[:, j], share, motion), corner, j) for j in range(z.shape[1])]
    return rows, share, norm


def _cost(model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float) -> float:
    """Return the cost without derivatives; inf where a segment blows up or a mode does not decay."""
    z = np.vstack(simulated(model, segments, max_step))
    with np.errstate(invalid="ignore", over="ignore"):
        if not np.abs(z).max() < FAR or np.any(model.eigenvalues.real >= 0):
            return float("inf")
    rows, _, norm = _projected(model, z, segments)
    weight, value = _prior(model)
    misfit = sum(float(row.residual @ row.residual) + row.penalty for row in rows) / norm
    return misfit + float(weight @ value**2) + growth(model)[0]


def linearise(model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float) -> _Linearised:
    """Simulate all segments with sensitivities, eliminate C, and return cost, gradient and Gauss-Newton Hessian."""
    return _normal_equations(model, segments, _sensitivities(model, segments, max_step))


def _normal_equations(
    model: RefinedDynamics, segments: tuple[Segment, ...], motion: tuple[ComplexArray, ComplexArray]
) -> _Linearised:
    """Return cost, gradient and Hessian for z and its sensitivities."""
    z, S = motion
    rows, share, norm = _projected(model, z, segments)
    C, rest = np.array([row.C for row in rows]), np.array([row.rest for row in rows]).T
    s = slopes(model.output, C, z)
    weight, value = _prior(model)
    cost, slope, curvature = growth(model)
    shared, n = len(weight), S.shape[2]
    hessian, gradient = np.zeros((n, n)), np.zeros(n)
    hessian[:shared, :shared] = np.diag(weight) + curvature
    gradient[:shared] = weight * value + slope
    cost += float(weight @ value**2)
    for j, row in enumerate(rows):
        J = share[:, None] * np.einsum("ti,tic->tc", s[:, j], S).real
        hessian += row.reduced(J) / norm
        gradient -= J.T @ row.residual / norm
        cost += (float(row.residual @ row.residual) + row.penalty) / norm
    return _Linearised(replace(model, C=C, rest=rest, cost=cost), hessian, gradient)


def _sensitivities(
    model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return z (n_sample, m) and dz (n_sample, m, n_unknown); initial states act on their own segment only."""
    m, kept = len(model.eigenvalues), model.resonant.any(axis=0)
    rows, terms = np.nonzero(model.resonant[:, kept])
    parameters = np.concatenate([np.arange(m), rows]), np.concatenate([np.arange(m), m + terms])
    linear = np.eye(2 * m, dtype=np.int64)[:m]
    table = (np.vstack([linear, model.exponents[kept]]), np.hstack([np.zeros((m, m)), model.B[:, kept]]))
    runs = [sensitivities(s.t, s.z0, model.eigenvalues, table, parameters, max_step) for s in segments]
    shared = 2 * len(parameters[0])
    S = np.zeros((sum(len(s.t) for s in segments), m, shared + 2 * m * len(segments)), dtype=np.complex128)
    first = 0
    for number, (_, own) in enumerate(runs):
        block = slice(first, first + len(own))
        S[block, :, :shared] = own[:, :, :shared]
        S[block, :, shared + 2 * m * number : shared + 2 * m * (number + 1)] = own[:, :, shared:]
        first += len(own)
    return np.vstack([run[0] for run in runs]), S
