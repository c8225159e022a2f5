"""Reduced coordinates y = (eta, eta') of a trajectory: modal, from sensors, or from delays of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from romgen.arrays import BoolArray, FloatArray
from romgen.differences import DROPPED, first_derivative, is_uniform, resample, second_derivative
from romgen.errors import InputError
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
    displacement, velocity : (n_time, n_sensor) m and m/s.
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
    """

    projection: FloatArray = field(metadata={"unit": "1", "axes": "mode,feature"})
    delays: int
    step: float
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "mode"})

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

    The first and last 4 samples have no difference and the last delays - 1 samples no window; both are dropped.
    Sampling other than ``chart.step`` is resampled by a spline.
    """
    t, x = uniform_samples(trajectory, chart.step)
    eta = windows(x, chart.delays) @ chart.projection.T
    inner = slice(DROPPED, len(eta) - DROPPED)
    eta_dot, eta_ddot = first_derivative(eta, chart.step), second_derivative(eta, chart.step)
    return ReducedTrajectory(
        name=trajectory.name,
        t=t[: len(eta)][inner],
        y=np.hstack([eta[inner], eta_dot]),
        y_dot=np.hstack([eta_dot, eta_ddot]),
        displacement=x[: len(eta)][inner],
        velocity=first_derivative(x, chart.step)[: len(eta_dot)],
    )


def uniform_samples(trajectory: Trajectory, step: float) -> tuple[FloatArray, FloatArray]:
    """Return t and displacement on a uniform grid of ``step``; unchanged where they already are."""
    if is_uniform(trajectory.t, step):
        return trajectory.t, trajectory.displacement
    return resample(trajectory.t, trajectory.displacement, step)


def windows(x: FloatArray, delays: int) -> FloatArray:
    """Return X (n_time - delays + 1, n_sensor * delays): x(t_k), x(t_{k+1}), .. side by side."""
    view = np.lib.stride_tricks.sliding_window_view(x, delays, axis=0)
    return view.transpose(0, 2, 1).reshape(len(view), -1)
