"""The chart of sensor data: modal directions from a fit of the linear dynamics, training data only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import SensorChart, uniform_samples, windows
from romgen.differences import DROPPED, first_derivative, second_derivative
from romgen.errors import InputError, NumericalError
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
    Differences enlarge noise and windows average it: where the first fit finds no decaying modes, windows are tried.

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
    samples = [uniform_samples(trajectory, step)[1] for trajectory in training]
    stacked = np.vstack(samples)
    shapes = principal_directions(stacked.T @ stacked)
    strength = np.sqrt(np.mean((stacked @ shapes) ** 2, axis=0))
    if int((strength > INFORMATIVE * strength[0]).sum()) < n_mode:
        return _delay_chart(samples, n_mode, step)
    try:
        return _displacement_chart(samples, shapes[:, :n_mode], step)
    except NumericalError as noisy:
        try:
            return _delay_chart(samples, n_mode, step)
        except (InputError, NumericalError):
            raise noisy from None


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
            value=np.array2string(eigenvalues, precision=4),
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


def _delay_chart(samples: Sequence[FloatArray], m: int, step: float) -> SensorChart:
    delays = _window_length(samples, step)
    if min(map(len, samples)) < delays + 4 * DROPPED:
        raise InputError("trajectory shorter than a delay window", where="sensor chart", value=min(map(len, samples)))
    X = [windows(x, delays) for x in samples]
    basis = principal_directions(np.asarray(sum(block.T @ block for block in X)))[:, : 2 * m]
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


def _window_length(samples: Sequence[FloatArray], step: float) -> int:
    """Return the samples in WINDOW_PERIODS of the strongest spectral line of the training data."""
    x = max(samples, key=len)
    power = np.sum(np.abs(np.fft.rfft(x - x.mean(axis=0), axis=0)) ** 2, axis=1)
    strongest = max(1, int(power.argmax()))
    return int(np.ceil(WINDOW_PERIODS * len(x) / strongest))


def _rotated_real(shape: ComplexArray) -> FloatArray:
    """Return the real part after the rotation that makes it largest: phi with Im(sum shape^2 e^(2 i phi)) = 0."""
    angle = -0.5 * np.angle(np.sum(shape**2))
    rotated: FloatArray = (shape * np.exp(1j * angle)).real
    return rotated


def _largest_entry(shapes: FloatArray) -> FloatArray:
    """Return the entry of largest magnitude of each column."""
    largest: FloatArray = shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])]
    return largest
