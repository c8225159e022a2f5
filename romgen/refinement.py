"""Refinement of a normal form on whole trajectories by variable projection and Levenberg-Marquardt.

The conjugacy cost weighs instantaneous derivatives; users see trajectories, where phase drift dominates. Unknowns are
the resonant coefficients B, small corrections of the eigenvalues, and one initial state per segment. The output
q = z + C phi(z), C over the non-resonant terms of each row (which fixes the near-identity gauge), is linear in C, so C
is eliminated (Golub and Pereyra 1973, with Kaufman's Jacobian). The cost is the mean of abs(q - q_data)^2 over
samples, rows and the mean square of the data, plus a ridge on B in the units of its sensitivity and a prior that ties
the eigenvalues to the linear fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.etdrk4 import march
from romgen.polynomial import monomial_gradient, monomials, zeta
from romgen.regression import ridge_fit
from romgen.variational import sensitivities

# One standard deviation of the prior on eigenvalues: share of Re(lambda) and of Im(lambda), at data error PRIOR_ERROR.
PRIOR_REAL, PRIOR_IMAG, PRIOR_ERROR = 0.1, 0.005, 0.02
MAX_REJECTIONS = 12
DECREASE = 1e-5
# Modal amplitudes of the data are at most 1/2; a trial that gets this far has blown up.
FAR = 1e3


@dataclass(frozen=True)
class Segment:
    """A stretch of a trajectory with its own initial state.

    Attributes
    ----------
    t : (n_time,) s.
    q : (n_time, m) modal coordinates of the data.
    z0 : (m,) initial state of the model.
    kept : (n_time,) samples that count; the others are held out.
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    q: ComplexArray = field(metadata={"unit": "1", "axes": "time,mode"})
    z0: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})
    kept: BoolArray = field(metadata={"unit": "1", "axes": "time"})


@dataclass(frozen=True)
class RefinedDynamics:
    """Normal form and output map during refinement.

    Attributes
    ----------
    eigenvalues : (m,) Lambda, 1/s; reference : (m,) the values they are tied to.
    exponents : (n_term, 2m) degree >= 2; resonant : (m, n_term) terms of B; output : (m, n_term) terms of C.
    B : (m, n_term) 1/s; C : (m, n_term).
    cost : relative mean square misfit with ridge and prior.
    """

    eigenvalues: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    reference: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode"})
    exponents: IntArray = field(metadata={"unit": "1", "axes": "term,variable"})
    resonant: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})
    output: BoolArray = field(metadata={"unit": "1", "axes": "mode,term"})
    B: ComplexArray = field(metadata={"unit": "1/s", "axes": "mode,term"})
    C: ComplexArray = field(metadata={"unit": "1", "axes": "mode,term"})
    cost: float = float("inf")


@dataclass(frozen=True)
class _Linearised:
    model: RefinedDynamics
    hessian: FloatArray
    gradient: FloatArray
    weight: FloatArray


def refine(
    model: RefinedDynamics,
    segments: Sequence[Segment],
    ridge: float,
    max_step: float,
    steps: int,
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """Return the model and segments after at most ``steps`` Levenberg-Marquardt steps.

    Parameters
    ----------
    model : start; segments : data and initial states.
    ridge : weight of B and C, no unit.
    max_step : internal step of the simulation, s.
    """
    segments = tuple(segments)
    weight = _prior_weight(model, len(segments))
    here = _linearise(model, segments, (ridge, max_step), weight)
    if not np.isfinite(here.model.cost):
        return model, segments
    damping = 1e-3
    for _ in range(steps):
        accepted = False
        for _ in range(MAX_REJECTIONS):
            H = here.hessian + damping * np.diag(np.maximum(np.diag(here.hessian), 1e-30))
            change: FloatArray = -np.linalg.solve(H, here.gradient).astype(np.float64)
            trial_model, trial_segments = _moved(here.model, segments, change)
            cost = _cost(trial_model, trial_segments, (ridge, max_step), here.weight)
            if cost < here.model.cost:
                accepted = True
                break
            damping *= 8.0
        if not accepted:
            break
        gain = (here.model.cost - cost) / here.model.cost
        segments, damping = trial_segments, max(damping / 8.0, 1e-9)
        here = _linearise(trial_model, segments, (ridge, max_step), here.weight)
        if gain < DECREASE:
            break
    return here.model, segments


def grown(model: RefinedDynamics, exponents: IntArray, resonant: BoolArray) -> RefinedDynamics:
    """Return the model over a longer table of terms, whose first rows are the old ones; new coefficients are 0."""
    more = ((0, 0), (0, len(exponents) - len(model.exponents)))
    return replace(
        model,
        exponents=exponents,
        resonant=resonant,
        output=~resonant,
        B=np.pad(model.B, more),
        C=np.pad(model.C, more),
        cost=float("inf"),
    )


def _parameters(model: RefinedDynamics) -> tuple[IntArray, IntArray]:
    """Row and term of each unknown in the table of ``_simulate``: eigenvalue corrections, then B."""
    m = len(model.eigenvalues)
    rows, terms = np.nonzero(model.resonant[:, model.resonant.any(axis=0)])
    return np.concatenate([np.arange(m), rows]), np.concatenate([np.arange(m), m + terms])


def _moved(
    model: RefinedDynamics, segments: tuple[Segment, ...], change: FloatArray
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    m = len(model.eigenvalues)
    rows, terms = np.nonzero(model.resonant)
    shared = 2 * (m + len(rows))
    delta = change[:shared:2] + 1j * change[1:shared:2]
    B = model.B.copy()
    B[rows, terms] += delta[m:]
    starts = change[shared:].reshape(len(segments), 2 * m)
    moved = tuple(
        replace(segment, z0=segment.z0 + d[:m] + 1j * d[m:]) for segment, d in zip(segments, starts, strict=True)
    )
    return replace(model, eigenvalues=model.eigenvalues + delta[:m], B=B), moved


def _prior_weight(model: RefinedDynamics, n_segment: int) -> FloatArray:
    """Return the diagonal weights of eigenvalue corrections, in (Re, Im) pairs; zero for all other unknowns."""
    m = len(model.eigenvalues)
    weight = np.zeros(2 * (m + int(model.resonant.sum())) + 2 * m * n_segment)
    weight[: 2 * m : 2] = (PRIOR_ERROR / (PRIOR_REAL * model.reference.real)) ** 2
    weight[1 : 2 * m : 2] = (PRIOR_ERROR / (PRIOR_IMAG * model.reference.imag)) ** 2
    return weight


def _linearise(
    model: RefinedDynamics, segments: tuple[Segment, ...], settings: tuple[float, float], weight: FloatArray
) -> _Linearised:
    """Simulate all segments, eliminate C, and return cost, gradient and Gauss-Newton Hessian."""
    ridge, max_step = settings
    m, E = len(model.eigenvalues), model.exponents
    rows, terms = _parameters(model)
    runs = _simulate(model, segments, (rows, terms), max_step)
    z = np.vstack([run[0] for run in runs])
    nothing = np.zeros(0)
    if not np.isfinite(z).all() or np.any(model.eigenvalues.real >= 0):
        return _Linearised(replace(model, cost=float("inf")), nothing, nothing, weight)
    q = np.vstack([s.q for s in segments])
    share = _shares(segments)
    C, phi = _projected_output(model, z, q, share, ridge)
    residual = share * (q - z - phi @ C.T)
    norm = float(np.sum(np.abs(share * q) ** 2))
    J = _output_sensitivity(E, C, z, [run[1] for run in runs], len(rows))
    hessian, gradient = np.zeros((J.shape[2], J.shape[2])), np.zeros(J.shape[2])
    for j in range(m):
        basis = share * phi[:, model.output[j]]
        column = share * J[:, j]
        D = column - basis @ ridge_fit(basis, column, ridge).T
        stacked = np.vstack([D.real, D.imag])
        hessian += stacked.T @ stacked / norm
        gradient -= stacked.T @ np.concatenate([residual[:, j].real, residual[:, j].imag]) / norm
    return _regularised(
        replace(model, C=C), hessian, gradient, float(np.sum(np.abs(residual) ** 2)) / norm, weight, ridge
    )


def _simulate(
    model: RefinedDynamics, segments: tuple[Segment, ...], parameters: tuple[IntArray, IntArray], max_step: float
) -> list[tuple[ComplexArray, ComplexArray]]:
    """Integrate the segments over the linear terms, to be corrected, and the resonant terms; all others are 0."""
    m = len(model.eigenvalues)
    linear, kept = np.eye(2 * m, dtype=np.int64)[:m], model.resonant.any(axis=0)
    table = (np.vstack([linear, model.exponents[kept]]), np.hstack([np.zeros((m, m)), model.B[:, kept]]))
    return [sensitivities(s.t, s.z0, model.eigenvalues, table, parameters, max_step) for s in segments]


def _free(
    segment: Segment, eigenvalues: ComplexArray, normal_form: tuple[IntArray, ComplexArray], max_step: float
) -> ComplexArray:
    """Return z (n_time, m) of a segment without sensitivities."""
    still = np.zeros((len(segment.t) - 1, len(eigenvalues)), dtype=np.complex128)
    return march(segment.t, segment.z0, eigenvalues, *normal_form, still, still, max_step)


def _projected_output(
    model: RefinedDynamics, z: ComplexArray, q: ComplexArray, share: FloatArray, ridge: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return the C that fits q - z best, and phi(z)."""
    phi = monomials(zeta(z), model.exponents)
    C = np.zeros_like(model.C)
    for j, output in enumerate(model.output):
        C[j, output] = ridge_fit(share * phi[:, output], share * (q[:, j : j + 1] - z[:, j : j + 1]), ridge)[0]
    return C, phi


def _shares(segments: tuple[Segment, ...]) -> FloatArray:
    """Return the weight of each sample, (n_sample, 1): one over the largest abs(q) of its segment, as in the NMTE."""
    weights = [s.kept[:, None] / np.linalg.norm(s.q[s.kept], axis=1).max() for s in segments]
    return np.vstack(weights)


def _cost(
    model: RefinedDynamics, segments: tuple[Segment, ...], settings: tuple[float, float], weight: FloatArray
) -> float:
    """Return the cost without derivatives; inf where a segment blows up or a mode does not decay."""
    ridge, max_step = settings
    E, B = model.exponents[model.resonant.any(axis=0)], model.B[:, model.resonant.any(axis=0)]
    z = np.vstack([_free(s, model.eigenvalues, (E, B), max_step) for s in segments])
    if not np.abs(z).max() < FAR or np.any(model.eigenvalues.real >= 0):
        return float("inf")
    q = np.vstack([s.q for s in segments])
    share = _shares(segments)
    C, phi = _projected_output(model, z, q, share, ridge)
    misfit = float(np.sum(np.abs(share * (q - z - phi @ C.T)) ** 2)) / float(np.sum(np.abs(share * q) ** 2))
    return misfit + float(weight @ _tied(model, len(weight)) ** 2)


def _tied(model: RefinedDynamics, n_unknown: int) -> FloatArray:
    """Return what prior and ridge pull to zero: eigenvalue corrections and B, in (Re, Im) pairs, then zeros."""
    rows, terms = np.nonzero(model.resonant)
    values = np.concatenate([model.eigenvalues - model.reference, model.B[rows, terms]])
    tied = np.zeros(n_unknown)
    tied[: 2 * len(values) : 2], tied[1 : 2 * len(values) : 2] = values.real, values.imag
    return tied


def _regularised(
    model: RefinedDynamics, hessian: FloatArray, gradient: FloatArray, misfit: float, weight: FloatArray, ridge: float
) -> _Linearised:
    """Add the prior on the eigenvalues and the ridge on B; ridge weights are set at the first call and kept."""
    m = len(model.eigenvalues)
    first, last = 2 * m, 2 * (m + int(model.resonant.sum()))
    if not weight[first:last].any():
        weight = weight.copy()
        weight[first:last] = ridge * np.diag(hessian)[first:last]
    value = _tied(model, len(weight))
    cost = misfit + float(weight @ value**2)
    return _Linearised(replace(model, cost=cost), hessian + np.diag(weight), gradient + weight * value, weight)


def _output_sensitivity(
    E: IntArray, C: ComplexArray, z: ComplexArray, runs: list[ComplexArray], n_parameter: int
) -> ComplexArray:
    """Return d(z + C phi(z)) to all unknowns, (n_sample, m, n_unknown); starts act on their own segment only."""
    m, shared = z.shape[1], 2 * n_parameter
    zz = zeta(z)
    slopes = np.stack([monomial_gradient(zz, E, i) @ C.T for i in range(2 * m)], axis=-1)
    J = np.zeros((len(z), m, shared + 2 * m * len(runs)), dtype=np.complex128)
    first = 0
    for number, S in enumerate(runs):
        rows = slice(first, first + len(S))
        total = S + np.einsum("tji,tic->tjc", slopes[rows, :, :m], S)
        total += np.einsum("tji,tic->tjc", slopes[rows, :, m:], S.conj())
        J[rows, :, :shared] = total[:, :, :shared]
        start = shared + 2 * m * number
        J[rows, :, start : start + 2 * m] = total[:, :, shared:]
        first += len(S)
    return J
