"""The chart of sensor data: modal directions from a fit of the linear dynamics, training data only."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import SensorChart, grid_samples, recorded_length, uniform_samples, windows
from romgen.differences import DROPPED, first_derivative, second_derivative
from romgen.errors import InputError, NumericalError
from romgen.low_pass import LowPass, low_pass
from romgen.noise_floor import LineSpectrum, line_frequencies, line_spectrum, separate_lines, strongest_period
from romgen.polynomial import exponents, monomials
from romgen.regression import ridge_fit
from romgen.trajectory import Trajectory

# Principal components below this share of the largest RMS carry no mode of their own.
INFORMATIVE = 0.02
# Cubic terms absorb the amplitude dependence, so that the linear part is that of small motion.
FIT_ORDER = 3
FIT_RIDGE = 1e-10
# A window of delays spans this many periods of the slowest line of the spectrum.
WINDOW_PERIODS = 2.0


def learn_sensor_chart(training: Sequence[Trajectory], n_mode: int) -> SensorChart:
    """Return the sensor chart of the training trajectories.

    With at least n_mode informative sensors the principal displacements u and u' are the state of the linear fit,
    otherwise the 2 n_mode principal components of delay windows. The eigenvectors of its linear part give P.
    Differences enlarge noise: what is noisy and finely sampled is low-passed first. Windows average what is left:
    where the first fit finds no decaying modes, or others than the spectrum shows, windows are tried.

    Parameters
    ----------
    training : trajectories with the same sensors.
    n_mode : m, number of master modes.

    Raises
    ------
    InputError : too few samples for the windows.
    NumericalError : the linear fit has no n_mode oscillating, decaying modes.
    """
    step = min(float(np.median(np.diff(trajectory.t))) for trajectory in training)
    recorded = [uniform_samples(trajectory, step)[1] for trajectory in training]
    spectrum = line_spectrum(recorded, step)
    filtered = low_pass(spectrum, step, max(float(np.linalg.norm(x, axis=1).max()) for x in recorded))
    samples = [grid_samples(trajectory, step, filtered)[2] for trajectory in training]
    grid = step if filtered is None else step * filtered.stride
    noise = np.sqrt(spectrum.noise / samples[0].shape[1]) * (1.0 if filtered is None else filtered.noise_gain)
    shapes = informative_directions(np.vstack(samples), n_mode, float(noise))
    held = _Held(spectrum, shapes.shape[1])
    charts: list[SensorChart] = []
    failures: list[InputError | NumericalError] = []
    for number in range(2):
        try:
            if number == 1:
                found = _delay_chart(samples, n_mode, grid, filtered)
            elif shapes.shape[1] == n_mode:
                found = _displacement_chart(samples, shapes, grid)
            else:
                continue
        except (InputError, NumericalError) as failure:
            failures.append(failure)
            continue
        charts.append(replace(found, low_pass=filtered, doubt=held.doubt(found)))
        if not charts[-1].doubt:
            return charts[-1]
    if not charts:
        raise held.explained(failures[0], n_mode)
    best = min(charts, key=lambda chart: float(held.distances(chart).max()))
    if held.has_strangers(best) and held.n_mode < n_mode:
        raise held.explained(NumericalError(best.doubt, where="sensor chart"), n_mode)
    return best


@dataclass(frozen=True)
class _Held:
    """What the data hold before any fit: lines of the spectrum and independent shapes of the sensors."""

    spectrum: LineSpectrum
    n_shape: int

    @property
    def lines(self) -> tuple[float, ...]:
        return separate_lines(self.spectrum, INFORMATIVE)

    @property
    def n_mode(self) -> int:
        """Modes of one frequency have shapes of their own, modes of one shape frequencies."""
        return max(len(self.lines), self.n_shape)

    def distances(self, chart: SensorChart) -> FloatArray:
        """Return how far each frequency of the chart is from a line at any amplitude, (m,) Hz."""
        lines = line_frequencies(self.spectrum)
        if not lines.size:
            return np.zeros(len(chart.frequency_hz))
        distances: FloatArray = np.abs(chart.frequency_hz[:, None] - lines).min(axis=1)
        return distances

    def has_strangers(self, chart: SensorChart) -> bool:
        """Whether the chart has a mode without a line."""
        return bool((self.distances(chart) > self.spectrum.resolution_hz).any())

    def doubt(self, chart: SensorChart) -> str:
        """Say what speaks against the modes of a chart; "" where nothing does."""
        few = self.n_mode < len(chart.frequency_hz)
        if not few and not self.has_strangers(chart):
            return ""
        found, shown = _listed(chart.frequency_hz), _listed(self.lines)
        return f"the chart of the sensors has modes at {found}, the spectrum has lines at {shown}" + (
            " and the sensors show no more shapes than these" if few else ""
        )

    def explained(self, failure: InputError | NumericalError, n_mode: int) -> InputError | NumericalError:
        """Return the failure of a chart; where the data hold too few modes, an error that says so."""
        count = self.n_mode
        if count >= n_mode or not self.lines:
            return failure
        modes = "one mode" if count == 1 else f"{count} modes"
        return NumericalError(
            f"{n_mode} master modes are asked for, but the data hold {modes}",
            where="sensor chart",
            value=f"spectral lines at {_listed(self.lines)}",
            advice=f"set [learn] master_modes to {list(range(1, count + 1))}, or excite the other modes more",
        )


def _listed(frequencies: Iterable[float]) -> str:
    shown = ", ".join(f"{f:.4g}" for f in frequencies)
    return f"{shown} Hz" if shown else "no frequency"


def informative_directions(x: FloatArray, n_mode: int, noise: float) -> FloatArray:
    """Return the strongest principal directions of x (n_time, n_sensor) as columns, at most n_mode.

    Those below a share of the strongest, or with no more signal than ``noise`` (RMS of a sensor), carry no mode of
    their own.
    """
    shapes = principal_directions(x.T @ x)
    power = np.mean((x @ shapes) ** 2, axis=0)
    informative = power > np.maximum(INFORMATIVE**2 * power[0], 2.0 * noise**2)
    return shapes[:, : min(n_mode, int(informative.sum()))]


def principal_directions(gram: FloatArray) -> FloatArray:
    """Return the eigenvectors of X' X as columns, strongest first."""
    return np.linalg.eigh(gram)[1][:, ::-1]


def linear_modes(c: FloatArray, c_dot: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return eigenvalues (m,) with Im > 0, ascending, and eigenvectors (2m, m) of the linear part of c' = r(c).

    r is a cubic polynomial fitted to c, c_dot (n_time, 2m).

    Raises
    ------
    NumericalError : not m oscillating, decaying pairs.
    """
    scale = np.abs(c).max(axis=0)
    R = ridge_fit(monomials(c / scale, exponents(c.shape[1], 1, FIT_ORDER)), c_dot / scale, FIT_RIDGE)
    eigenvalues, vectors = np.linalg.eig(R[:, : c.shape[1]])
    upper = np.flatnonzero(eigenvalues.imag > 0)
    if 2 * len(upper) != c.shape[1] or np.any(eigenvalues.real >= 0):
        raise NumericalError(
            "the linear dynamics of the sensors are not that of decaying oscillations",
            where="sensor chart",
            value=eigenvalues,
            advice="check the number of master modes, units, sampling and noise, or give longer decays",
        )
    order = upper[np.argsort(eigenvalues.imag[upper])]
    return eigenvalues[order].astype(complex), (scale[:, None] * vectors[:, order]).astype(complex)


def _displacement_chart(samples: Sequence[FloatArray], shapes: FloatArray, step: float) -> SensorChart:
    m = shapes.shape[1]
    u = [x @ shapes for x in samples]
    inner = [values[DROPPED : len(values) - DROPPED] for values in u]
    u_dot = np.vstack([first_derivative(values, step) for values in u])
    u_ddot = np.vstack([second_derivative(values, step) for values in u])
    eigenvalues, vectors = linear_modes(np.hstack([np.vstack(inner), u_dot]), np.hstack([u_dot, u_ddot]))
    real_shapes = np.column_stack([_rotated_real(vectors[:m, j]) for j in range(m)])
    largest = _largest_entry(shapes @ real_shapes)
    return SensorChart(
        projection=largest[:, None] * np.linalg.solve(real_shapes, shapes.T),
        delays=1,
        step=step,
        frequency_hz=eigenvalues.imag / (2.0 * np.pi),
    )


def _delay_chart(samples: Sequence[FloatArray], m: int, step: float, filtered: LowPass | None) -> SensorChart:
    delays = int(np.ceil(WINDOW_PERIODS * strongest_period(max(samples, key=len))))
    shortest, needed = min(map(len, samples)), delays + 4 * DROPPED
    if shortest < needed:
        raise InputError(
            "trajectory shorter than a delay window",
            where="sensor chart",
            value=f"{recorded_length(shortest, filtered)} samples",
            advice=f"at least {recorded_length(needed, filtered)} samples are needed, two periods and the differences",
        )
    X = [windows(x, delays) for x in samples]
    gram = np.asarray(sum(block.T @ block for block in X))
    if np.linalg.matrix_rank(gram, hermitian=True) < 2 * m:
        raise NumericalError("windows of the sensors hold fewer motions than modes", where="sensor chart", value=m)
    basis = principal_directions(gram)[:, : 2 * m]
    c = [block @ basis for block in X]
    inner = np.vstack([values[DROPPED : len(values) - DROPPED] for values in c])
    eigenvalues, vectors = linear_modes(inner, np.vstack([first_derivative(values, step) for values in c]))
    inverse = np.linalg.inv(np.hstack([vectors, vectors.conj()]))[:m]
    n_sensor = samples[0].shape[1]
    shapes = basis[:n_sensor] @ vectors
    strongest = shapes[np.abs(shapes).argmax(axis=0), np.arange(m)]
    return SensorChart(
        projection=2.0 * (strongest[:, None] * (inverse @ basis.T)).real,
        delays=delays,
        step=step,
        frequency_hz=eigenvalues.imag / (2.0 * np.pi),
    )


def _rotated_real(shape: ComplexArray) -> FloatArray:
    """Return the real part after the rotation that makes it largest: phi with Im(sum shape^2 e^(2 i phi)) = 0."""
    angle = -0.5 * np.angle(np.sum(shape**2))
    rotated: FloatArray = (shape * np.exp(1j * angle)).real
    return rotated


def _largest_entry(shapes: FloatArray) -> FloatArray:
    """Return the entry of largest magnitude of each column."""
    largest: FloatArray = shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])]
    return largest
