"""Reduced coordinates y = (eta, eta') of a trajectory: modal, from sensors, or from delays of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from romgen.arrays import BoolArray, FloatArray
from romgen.differences import DROPPED, first_derivative, is_uniform, resample, second_derivative
from romgen.errors import InputError
from romgen.low_pass import LowPass, smoothed
from romgen.trajectory import Trajectory


@dataclass(frozen=True)
class ReducedTrajectory:
    """A trajectory in reduced coordinates with its sensors at the same times.

    Attributes
    ----------
    name : of the trajectory.
    t : (n_time,) s.
    y : (n_time, 2m) eta_1..m and eta'_1..m.
    y_dot : (n_time, 2m) their time derivatives.
    displacement, velocity : (n_time, n_sensor) m as recorded, and m/s.
    """

    name: str
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    y: FloatArray = field(metadata={"unit": "mixed", "axes": "time,coordinate"})
    y_dot: FloatArray = field(metadata={"unit": "mixed", "axes": "time,coordinate"})
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    velocity: FloatArray = field(metadata={"unit": "m/s", "axes": "time,sensor"})

    def masked(self, keep: BoolArray) -> ReducedTrajectory:
        """Return the samples where ``keep`` (n_time,) is True."""
        arrays = self.t, self.y, self.y_dot, self.displacement, self.velocity
        return ReducedTrajectory(self.name, *(x[keep] for x in arrays))


@dataclass(frozen=True)
class SensorChart:
    """Linear functionals eta = P X of sensor windows X(t_k) = (x(t_k), .., x(t_{k + delays - 1})).

    Attributes
    ----------
    projection : (m, n_sensor * delays) P; mode j moves its largest sensor by eta_j.
    delays : samples in a window, 1 = the sensors themselves.
    step : s, of the uniform grid of windows and differences.
    frequency_hz : (m,) frequencies of the linear fit that defines P.
    low_pass : what noisy records go through first, to that grid; None where they stay as they are.
    doubt : why the frequencies may not be those of the modes, one clause; "" where nothing speaks against them.
    """

    projection: FloatArray = field(metadata={"unit": "1", "axes": "mode,feature"})
    delays: int
    step: float
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "mode"})
    low_pass: LowPass | None = None
    doubt: str = ""

    @property
    def recorded_step(self) -> float:
        """The step in s of the records before the low-pass."""
        return self.step if self.low_pass is None else self.step / self.low_pass.stride

    def of_modes(self, rows: Sequence[int]) -> SensorChart:
        """Return the chart of some of its modes, by their rows."""
        return replace(self, projection=self.projection[list(rows)], frequency_hz=self.frequency_hz[list(rows)])


def modal_chart(trajectory: Trajectory, modes: Sequence[int]) -> ReducedTrajectory:
    """Return y = (eta, eta') and y' = (eta', eta'') as the trajectory carries them.

    Parameters
    ----------
    trajectory : with eta, eta_dot, eta_ddot (n_time, n_mode) and sensor velocities.
    modes : columns of eta that are master modes.

    Raises
    ------
    InputError : modal fields or velocities are missing, or there are fewer modes.
    """
    eta, eta_dot, eta_ddot = trajectory.eta, trajectory.eta_dot, trajectory.eta_ddot
    if eta is None or eta_dot is None or eta_ddot is None or trajectory.velocity is None:
        raise InputError(
            "modal displacement, velocity, acceleration and sensor velocity are needed",
            where=f"trajectory '{trajectory.name}'",
            advice="write them with the finite-element ring-downs, or learn from sensors only",
        )
    columns = list(modes)
    if max(columns) >= eta.shape[1]:
        raise InputError("too few modes", where=f"trajectory '{trajectory.name}'", value=eta.shape[1])
    return ReducedTrajectory(
        name=trajectory.name,
        t=trajectory.t,
        y=np.hstack([eta[:, columns], eta_dot[:, columns]]),
        y_dot=np.hstack([eta_dot[:, columns], eta_ddot[:, columns]]),
        displacement=trajectory.displacement,
        velocity=trajectory.velocity,
    )


def sensor_chart(chart: SensorChart, trajectory: Trajectory) -> ReducedTrajectory:
    """Return y = (P X, P X') and y' with X' and X'' by central differences of order 8.

    The first and last 4 samples have no difference and the last delays - 1 samples no window; both are dropped, and so
    are the ends that a low-pass loses. Sampling other than ``chart.recorded_step`` is resampled by a spline.

    Raises
    ------
    InputError : too short for the low-pass, the windows and the differences.
    """
    t, recorded, x = grid_samples(trajectory, chart.recorded_step, chart.low_pass)
    _check_length(len(x), chart.delays, chart.low_pass, f"trajectory '{trajectory.name}'")
    eta = windows(x, chart.delays) @ chart.projection.T
    inner = slice(DROPPED, len(eta) - DROPPED)
    eta_dot, eta_ddot = first_derivative(eta, chart.step), second_derivative(eta, chart.step)
    return ReducedTrajectory(
        name=trajectory.name,
        t=t[: len(eta)][inner],
        y=np.hstack([eta[inner], eta_dot]),
        y_dot=np.hstack([eta_dot, eta_ddot]),
        displacement=recorded[: len(eta)][inner],
        velocity=first_derivative(x, chart.step)[: len(eta_dot)],
    )


def grid_samples(
    trajectory: Trajectory, step: float, low_pass: LowPass | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return t, displacement as recorded, and the one to differentiate, on the uniform grid of the chart.

    Parameters
    ----------
    step : s, of the records; low_pass : that the data need, None leaves them.
    """
    t, x = uniform_samples(trajectory, step)
    return (t, x, x) if low_pass is None else smoothed(low_pass, t, x, f"trajectory '{trajectory.name}'")


def uniform_samples(trajectory: Trajectory, step: float) -> tuple[FloatArray, FloatArray]:
    """Return t and displacement on a uniform grid of ``step``; unchanged where they already are."""
    if is_uniform(trajectory.t, step):
        return trajectory.t, trajectory.displacement
    return resample(trajectory.t, trajectory.displacement, step)


def windows(x: FloatArray, delays: int) -> FloatArray:
    """Return X (n_time - delays + 1, n_sensor * delays): x(t_k), x(t_{k+1}), .. side by side."""
    view = np.lib.stride_tricks.sliding_window_view(x, delays, axis=0)
    return view.transpose(0, 2, 1).reshape(len(view), -1)


def recorded_length(n_sample: int, low_pass: LowPass | None) -> int:
    """Return how many recorded samples leave n_sample on the grid of the chart."""
    return n_sample if low_pass is None else (n_sample - 1) * low_pass.stride + len(low_pass.taps)


def _check_length(n_sample: int, delays: int, low_pass: LowPass | None, where: str) -> None:
    """Refuse a record that leaves no sample after windows and differences."""
    needed = delays + 2 * DROPPED
    if n_sample < needed:
        raise InputError(
            "trajectory too short for windows and derivatives",
            where=where,
            value=f"{recorded_length(n_sample, low_pass)} samples",
            advice=f"at least {recorded_length(needed, low_pass)} samples are needed",
        )
