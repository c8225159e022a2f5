"""How far a reduced model is from a recorded motion, started from the first window of that motion."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory
from romgen.chart_inverse import chart_inverse, linear_start
from romgen.errors import NumericalError
from romgen.initial_window import fitted_start
from romgen.manifold import Manifold, nmte_blocks
from romgen.metrics import nmte_percent
from romgen.polynomial import evaluate
from romgen.reduced_model import ReducedModel
from romgen.simulate import coordinates, free_motion, sensors
from romgen.trajectory import Trajectory

REST_PERIODS = 10.0


@dataclass(frozen=True)
class TrajectoryError:
    """One trajectory against the model that starts from its first window.

    Attributes
    ----------
    name : of the trajectory.
    nmte_percent : NMTE in full displacement coordinates where snapshots exist, else of the sensors; inf where the model
        diverges.
    sensor_nmte_percent : NMTE of the sensor displacements.
    first_sample_percent : the same, but started from the first sample alone instead of the first window.
    static_percent : NMTE of the sensors lifted from the true reduced coordinates: the error of the manifold alone.
    rest_percent : norm of the mean misfit of the sensors over the last ten periods of the slowest mode, relative to
        the largest norm: what lies between the rest position of the motion and the equilibrium of the model; nan where
        the model diverges.
    about_rest_percent : NMTE of the sensors with that mean misfit taken off, the error about the motion's own rest
        position: beside ``sensor_nmte_percent``, not instead of it.
    start : (m,) z of the model at t[0].
    start_fitted : whether the start fits the first window; False where the model diverges within it from every start
        that was tried, and the inverse of the linear chart at the first sample was taken.
    diverged_s : time on the axis t from which the model has left all bounds, s; nan where it never does.
    t : (n_time,) s; displacement, predicted : (n_time, n_sensor) m, predicted is nan from a divergence on.
    """

    name: str
    nmte_percent: float
    sensor_nmte_percent: float
    first_sample_percent: float
    static_percent: float
    rest_percent: float
    about_rest_percent: float
    start: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})
    start_fitted: bool
    diverged_s: float
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    predicted: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})


def trajectory_error(
    model: ReducedModel, r: ReducedTrajectory, trajectory: Trajectory, full: Manifold | None
) -> TrajectoryError:
    """Simulate from the first window of a trajectory and compare with all of it."""
    z0, fitted = _first_window(model, r)
    z = free_motion(model, r.t, z0)
    lost = ~np.isfinite(z).all(axis=1)
    finite = not lost.any()
    predicted = sensors(model, z)[0]
    sensor_error = nmte_percent(r.displacement, predicted) if finite else float("inf")
    unfitted = free_motion(model, r.t, chart_inverse(model, r.y[0])[0])
    cold = nmte_percent(r.displacement, sensors(model, unfitted)[0]) if np.isfinite(unfitted).all() else float("inf")
    error = sensor_error
    if finite and full is not None and trajectory.snapshots is not None and trajectory.snapshot_index is not None:
        rows, snapshots = snapshot_rows(trajectory, r)
        error = nmte_blocks(full, snapshots, coordinates(model, z)[rows])
    static = nmte_percent(r.displacement, evaluate(model.displacement, r.y / model.scale))
    rest, about_rest = _rest_errors(r, predicted, model)
    return TrajectoryError(
        name=r.name,
        nmte_percent=error,
        sensor_nmte_percent=sensor_error,
        first_sample_percent=cold,
        static_percent=static,
        rest_percent=rest,
        about_rest_percent=about_rest if finite else float("inf"),
        start=z0,
        start_fitted=fitted,
        diverged_s=float("nan") if finite else float(r.t[int(lost.argmax())]),
        t=r.t,
        displacement=r.displacement,
        predicted=predicted,
    )


def _rest_errors(r: ReducedTrajectory, predicted: FloatArray, model: ReducedModel) -> tuple[float, float]:
    """Return the norm of the mean late misfit, and the mean norm of what is left without it, in percent."""
    period = 2.0 * np.pi / float(model.eigenvalues.imag.min())
    late = r.t > r.t[-1] - REST_PERIODS * period
    misfit, largest = r.displacement - predicted, float(np.linalg.norm(r.displacement, axis=1).max())
    rest = misfit[late].mean(axis=0)
    left = float(np.linalg.norm(misfit - rest, axis=1).mean())
    return 100.0 * float(np.linalg.norm(rest)) / largest, 100.0 * left / largest


def _first_window(model: ReducedModel, r: ReducedTrajectory) -> tuple[ComplexArray, bool]:
    """Return the start, and whether it was fitted; where the model diverges in the window it comes from one sample."""
    try:
        return fitted_start(model, r), True
    except NumericalError:
        return linear_start(model, r.y[0]), False


def snapshot_rows(trajectory: Trajectory, r: ReducedTrajectory) -> tuple[IntArray, npt.NDArray[np.float32]]:
    """Return the rows of r of the snapshots that start_time left, and these snapshots."""
    assert trajectory.snapshots is not None
    assert trajectory.snapshot_index is not None
    first = len(trajectory.t) - len(r.t)
    keep = trajectory.snapshot_index >= first
    return trajectory.snapshot_index[keep] - first, trajectory.snapshots[keep]
