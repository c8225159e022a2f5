"""Least squares of a modal load on measured forced points, in the logarithm of the level.

At every point the model needs the level s_i L_i to show the measured amplitude, L_i being the level that was applied.
With r_i = ln s_i the loads f minimise sum_i (r_i / sigma_i)^2. The measured amplitude, the level and the frequency (of
the measurement or of the model) err by small shares e, which reach r_i through the slopes of the branch:

    sigma_i^2 = e_level^2 + (e_amplitude d ln level / d ln amplitude)^2 + (e_frequency d ln level / d ln frequency)^2

On a flank the frequency decides, so flanks count little; beside a fold a small change of load moves the amplitude far:
the load is known well there, but never better than the level itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from romgen.arrays import FloatArray
from romgen.errors import InputError, NumericalError
from romgen.forcing import chart_input_matrix, sensor_shapes
from romgen.load_path import LoadAtAmplitude, LoadPath, load_path
from romgen.load_system import MeasuredPoint
from romgen.reduced_model import ReducedModel

# Shares that a careful measurement repeats to and a good model errs by; they set weights and what counts as a conflict.
AMPLITUDE_ERROR, LEVEL_ERROR, FREQUENCY_ERROR = 0.02, 0.02, 0.001
# Step of the Jacobian: the levels are solved to 1e-10.
STEP = 1e-4
# Sums of squares that differ by less do not tell two signs apart at two standard deviations.
TOLD_APART = 4.0
# A load that errs by more than this is hardly known.
HARDLY = 30.0


@dataclass(frozen=True)
class LoadProblem:
    """Measured points of one input and the modes that it may drive.

    Attributes
    ----------
    model : without this input.
    points : measured states; loaded : indices of the modes with an unknown load, among them the mode of every point.
    where : how messages call the input.
    """

    model: ReducedModel
    points: Sequence[MeasuredPoint]
    loaded: tuple[int, ...]
    where: str

    def paths(self, f: FloatArray) -> list[LoadPath]:
        """Return the branch of every point under the modal load f (m,) per unit input."""
        column = chart_input_matrix(self.model, f[:, None])[:, 0]
        return [load_path(self.model, column, point) for point in self.points]

    def log_levels(self, needed: Sequence[LoadAtAmplitude]) -> FloatArray:
        """Return r (n_point,)."""
        return np.log([at.level / point.level for at, point in zip(needed, self.points, strict=True)])


@dataclass(frozen=True)
class LoadFit:
    """The fitted load.

    Attributes
    ----------
    modal_load : (m,) f.
    deviation_percent : (m,) its standard deviation; nan where no load was fitted.
    spread_percent : weighted standard deviation of the r_i, nan where nothing is left to judge it by.
    paths, needed : branch and solution of every point under f.
    resonances : the same amplitude in phase resonance; None where the model has none.
    expected_percent : (n_point,) 100 sigma.
    notes : what the points leave open.
    """

    modal_load: FloatArray = field(metadata={"unit": "m/s^2 per input unit", "axes": "mode"})
    deviation_percent: FloatArray = field(metadata={"unit": "percent", "axes": "mode"})
    spread_percent: float
    paths: tuple[LoadPath, ...]
    needed: tuple[LoadAtAmplitude, ...]
    resonances: tuple[LoadAtAmplitude | None, ...]
    expected_percent: FloatArray = field(metadata={"unit": "percent", "axes": "point"})
    notes: tuple[str, ...]


def fit_load(problem: LoadProblem, sign: float) -> LoadFit:
    """Return the modal load that explains the points best.

    Parameters
    ----------
    sign : of the acceleration of the first point's sensor per unit input; amplitudes do not show it.

    Raises
    ------
    InputError : a mode without a point near its frequency, an amplitude out of reach.
    NumericalError : an orbit was not found.
    """
    start, sigma = _start(problem)
    f, notes = start, tuple[str, ...]()
    if len(problem.loaded) > 1:
        f, notes = _several(problem, start, sigma)
    f = _turn(problem, f, sign) * f + 0.0  # no negative zeros
    paths = problem.paths(f)
    needed = [path.crossing() for path in paths]
    r = problem.log_levels(needed)
    sigma = _sigma(needed)
    deviation = _deviation(problem, f, r, sigma)
    for j in problem.loaded:
        if not deviation[j] < HARDLY:
            notes += (f"the points hardly determine the load on mode {j + 1}: deviation {deviation[j]:.0f} %",)
    return LoadFit(
        modal_load=f,
        deviation_percent=deviation,
        spread_percent=_spread(problem, r, sigma),
        paths=tuple(paths),
        needed=tuple(needed),
        resonances=tuple(_resonance(path, at) for path, at in zip(paths, needed, strict=True)),
        expected_percent=100.0 * sigma,
        notes=notes,
    )


def _resonance(path: LoadPath, at: LoadAtAmplitude) -> LoadAtAmplitude | None:
    """Return the solution of the same amplitude in phase resonance."""
    if path.point.peak:
        return at
    peak = replace(path.point, peak=True)
    try:
        return load_path(path.system.model, path.system.column, peak).crossing()
    except (InputError, NumericalError):  # an answer off resonance need not have a peak of the same amplitude
        return None


def _start(problem: LoadProblem) -> tuple[FloatArray, FloatArray]:
    """Return f (m,) with every mode alone from the points near it, and sigma (n_point,)."""
    m = problem.model.eigenvalues.size
    f, sigma = np.zeros(m), np.zeros(len(problem.points))
    for j in problem.loaded:
        rows = [k for k, point in enumerate(problem.points) if point.mode == j]
        if not rows:
            raise InputError(
                "no point is near this mode",
                where=problem.where,
                value=f"modes with {j + 1}",
                advice="measure near its frequency, or leave it out of modes",
            )
        own = LoadProblem(problem.model, [problem.points[k] for k in rows], (j,), problem.where)
        needed = [path.crossing() for path in own.paths(np.eye(m)[j])]
        sigma[rows] = _sigma(needed)
        f[j] = np.exp(np.average(own.log_levels(needed), weights=sigma[rows] ** -2))
    return f, sigma


def _sigma(needed: Sequence[LoadAtAmplitude]) -> FloatArray:
    slopes = np.array([(AMPLITUDE_ERROR * at.by_amplitude, FREQUENCY_ERROR * at.by_frequency) for at in needed])
    return np.asarray(np.sqrt(LEVEL_ERROR**2 + np.sum(slopes**2, axis=1)))


def _several(problem: LoadProblem, start: FloatArray, sigma: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the best f over all relative signs of the loads, and what is left open."""
    loaded = list(problem.loaded)
    tried, failures = [], list[InputError | NumericalError]()
    for signs in product((1.0, -1.0), repeat=len(loaded) - 1):
        try:
            solution = least_squares(
                lambda share: _residual(problem, start, share) / sigma, np.array((1.0, *signs)), diff_step=STEP
            )
        except (InputError, NumericalError) as error:  # wrong signs may leave a point out of reach
            failures.append(error)
            continue
        tried.append((2.0 * float(solution.cost), solution.x))
    if not tried:
        raise failures[0]
    tried.sort(key=lambda one: one[0])
    f = start.copy()
    f[loaded] *= tried[0][1]
    # a start with wrong signs may end at the right ones: then no other signs fit
    others = [cost for cost, share in tried if _signs(share) != _signs(tried[0][1])]
    if not others or others[0] - tried[0][0] > TOLD_APART:
        return f, ()
    modes = ", ".join(str(j + 1) for j in loaded)
    return f, (f"the points do not tell the relative signs of the loads on modes {modes}: the best fit was taken",)


def _signs(share: FloatArray) -> tuple[float, ...]:
    """Return the signs relative to the first."""
    return tuple((np.sign(share) * np.sign(share[0])).tolist())


def _residual(problem: LoadProblem, start: FloatArray, share: FloatArray) -> FloatArray:
    f = start.copy()
    f[list(problem.loaded)] *= share
    return problem.log_levels([path.crossing() for path in problem.paths(f)])


def _turn(problem: LoadProblem, f: FloatArray, sign: float) -> float:
    """Return +-1 so that the first point's sensor accelerates with ``sign`` per unit input."""
    first = problem.points[0]
    return float(np.sign(sensor_shapes(problem.model)[first.sensor, first.mode] * f[first.mode])) * sign


def _deviation(problem: LoadProblem, f: FloatArray, r: FloatArray, sigma: FloatArray) -> FloatArray:
    """Return the standard deviation of each load in percent (m,), from sigma or from residuals that are larger.

    One load scales all levels, d r_i / d ln f = -1; the slopes by several loads are differences.
    """
    loaded, n = list(problem.loaded), r.size
    J = -np.ones((n, 1)) / sigma[:, None]
    if len(loaded) > 1:
        one = np.ones(len(loaded))
        steps = STEP * np.eye(len(loaded))
        J = np.column_stack([(_residual(problem, f, one + h) - r) / STEP / sigma for h in steps])
    excess = float(np.sum((r / sigma) ** 2)) / (n - len(loaded)) if n > len(loaded) else 1.0
    deviation = np.full(f.size, np.nan)
    _, size, V = np.linalg.svd(J, full_matrices=False)
    variance = np.sum((V / np.maximum(size, np.finfo(np.float64).tiny)[:, None]) ** 2, axis=0)
    deviation[loaded] = 100.0 * np.sqrt(max(1.0, excess) * variance)
    return deviation


def _spread(problem: LoadProblem, r: FloatArray, sigma: FloatArray) -> float:
    left = r.size - len(problem.loaded)
    if left < 1:
        return float("nan")
    weights = sigma**-2 / np.sum(sigma**-2)
    mean = float(weights @ r)
    return 100.0 * float(np.sqrt(weights @ (r - mean) ** 2 * r.size / left))
