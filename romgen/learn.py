"""The learning stage: from trajectories to a reduced model with its errors on held-out motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.chart import ReducedTrajectory, SensorChart, modal_chart, sensor_chart
from romgen.differences import is_uniform
from romgen.errors import InputError, NumericalError
from romgen.initial_window import fitted_start
from romgen.manifold import Manifold, ManifoldFit, nmte_blocks
from romgen.metrics import nmte_percent
from romgen.normal_form import NormalFormFit, fit_normal_form
from romgen.order_selection import OrderTable, choose_order, simulation_error
from romgen.polynomial import PolynomialMap, evaluate, exponents
from romgen.reduced_model import ReducedModel
from romgen.sensor_modes import learn_sensor_chart
from romgen.settings import LearnSettings
from romgen.simulate import coordinates, free_motion, initial_state, sensors
from romgen.trajectory import Trajectory
from romgen.trajectory_fit import fit_on_trajectories, is_long_enough

# The full field is nearly linear plus quadratic in y; higher terms would cost n_dof numbers each.
FIELD_ORDER = 3
# A direct fit within this mean NMTE of the training data needs no refinement on trajectories.
GOOD_PERCENT = 0.1


@dataclass(frozen=True)
class Loads:
    """Load inputs in modal coordinates, eta'' = .. + modal_load u.

    Attributes
    ----------
    inputs, units : names and SI units.
    modal_load : (m, n_input) rows of the master modes.
    """

    inputs: tuple[str, ...]
    units: tuple[str, ...]
    modal_load: FloatArray = field(metadata={"unit": "kg^0.5 per input", "axes": "mode,input"})


@dataclass(frozen=True)
class TrajectoryError:
    """One trajectory against the model that starts from its first window.

    Attributes
    ----------
    name : of the trajectory.
    nmte_percent : NMTE in full displacement coordinates where snapshots exist, else of the sensors; inf where the model
        diverges.
    sensor_nmte_percent : NMTE of the sensor displacements.
    static_percent : NMTE of the sensors lifted from the true reduced coordinates: the error of the manifold alone.
    start : (m,) z of the model at t[0].
    t : (n_time,) s; displacement, predicted : (n_time, n_sensor) m, predicted is nan from a divergence on.
    """

    name: str
    nmte_percent: float
    sensor_nmte_percent: float
    static_percent: float
    start: ComplexArray = field(metadata={"unit": "1", "axes": "mode"})
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    predicted: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})


@dataclass(frozen=True)
class Learned:
    """A reduced model, how it was made, and what it gets wrong.

    Attributes
    ----------
    model : everything downstream reads this.
    fit : normal form with resonance table, cost, coefficient deviations.
    chart : chart of sensor data; None with modal coordinates.
    full_field : manifold of all degrees of freedom; None without snapshots.
    order : of the normal form; orders : how it was chosen, None where it was given.
    training, validation : errors; nothing of the validation trajectories enters the model.
    notes : what was resampled or left out, how the normal form was fitted, which motions diverge.
    """

    model: ReducedModel
    fit: NormalFormFit
    chart: SensorChart | None
    full_field: Manifold | None
    order: int
    orders: OrderTable | None
    training: tuple[TrajectoryError, ...]
    validation: tuple[TrajectoryError, ...]
    notes: tuple[str, ...]


def learn(
    training: Sequence[Trajectory],
    validation: Sequence[Trajectory],
    settings: LearnSettings,
    name: str,
    loads: Loads | None = None,
) -> Learned:
    """Learn the extended normal form of the training trajectories and test it on all.

    Chart, scales, order and every coefficient come from ``training`` alone. With modal fields in all trajectories the
    chart is modal and exact, otherwise it is estimated from the sensors.

    Parameters
    ----------
    training, validation : trajectories with the same sensors.
    settings : table [learn].
    name : identifier of the model.
    loads : load inputs; only with modal fields, None makes a model without inputs.

    Raises
    ------
    InputError : no training trajectory, different sensors, or loads without modal fields.
    NumericalError : the data are not those of decaying oscillations.
    """
    _check(training, validation, loads)
    m = len(settings.master_modes)
    chart = None if _is_modal(training) else learn_sensor_chart(training, m)
    reduced = [reduced_trajectory(trajectory, chart, settings) for trajectory in training]
    orders = choose_order(reduced, settings) if settings.order == "auto" else None
    order = orders.order if orders is not None else int(settings.order)
    fit = best_fit(reduced, order, settings)
    model = assemble(name, fit, reduced, settings, training[0].sensors, loads)
    full = _full_field(training, reduced, model, settings)
    held_out = [reduced_trajectory(trajectory, chart, settings) for trajectory in validation]
    return Learned(
        model=model,
        fit=fit,
        chart=chart,
        full_field=full,
        order=order,
        orders=orders,
        training=tuple(trajectory_error(model, r, x, full) for r, x in zip(reduced, training, strict=True)),
        validation=tuple(trajectory_error(model, r, x, full) for r, x in zip(held_out, validation, strict=True)),
        notes=_notes([*training, *validation], chart),
    )


def best_fit(training: Sequence[ReducedTrajectory], order: int, settings: LearnSettings) -> NormalFormFit:
    """Return the normal form, from conjugacy or from whole trajectories, that simulates the training data better.

    The conjugacy fit is exact for smooth data; friction and noise favour the fit on trajectories, which is tried where
    the data are long enough and the conjugacy fit misses them by more than GOOD_PERCENT.
    """
    direct = fit_normal_form(training, order, settings.internal_resonance, settings.ridge)
    error = simulation_error(direct, training)
    if error < GOOD_PERCENT or not is_long_enough(training, direct.dynamics.eigenvalues):
        return direct
    on_trajectories = fit_on_trajectories(training, order, settings.internal_resonance, settings.ridge)
    return on_trajectories if simulation_error(on_trajectories, training) < error else direct


def reduced_trajectory(trajectory: Trajectory, chart: SensorChart | None, settings: LearnSettings) -> ReducedTrajectory:
    """Return the trajectory in reduced coordinates from ``settings.start_time`` after its first sample on."""
    r = modal_chart(trajectory, _columns(trajectory, settings)) if chart is None else sensor_chart(chart, trajectory)
    keep = r.t >= trajectory.t[0] + settings.start_time
    if keep.sum() < len(exponents(r.y.shape[1], 1, 1)) + 1:
        raise InputError("nothing is left", where=f"trajectory '{trajectory.name}'", advice="lower [learn] start_time")
    return ReducedTrajectory(r.name, r.t[keep], r.y[keep], r.y_dot[keep], r.displacement[keep], r.velocity[keep])


def assemble(
    name: str,
    fit: NormalFormFit,
    training: Sequence[ReducedTrajectory],
    settings: LearnSettings,
    sensor_names: tuple[str, ...],
    loads: Loads | None,
) -> ReducedModel:
    """Return the model: normal form and charts of ``fit``, sensor maps by regression, G = (T^-1)_lin diag(1/s) [0; f].

    Parameters
    ----------
    training : gives the sensor maps and the trained amplitude.
    """
    y = np.vstack([r.y for r in training])
    dynamics = fit.dynamics
    m = len(dynamics.eigenvalues)
    order = settings.geometry_order or int(fit.normal_form.exponents.sum(axis=1).max())
    table, maps = exponents(2 * m, 1, order), []
    for x in (np.vstack([r.displacement for r in training]), np.vstack([r.velocity for r in training])):
        regression = ManifoldFit(x.shape[1], table, dynamics.scale)
        regression.add(x, y)
        maps.append(PolynomialMap(table, regression.finish(settings.ridge).coefficients))
    modal_load = np.zeros((m, 0)) if loads is None else loads.modal_load
    force = np.vstack([np.zeros_like(modal_load), modal_load]) / dynamics.scale[:, None]
    z = evaluate(fit.inverse_chart, y / dynamics.scale)
    return ReducedModel(
        name=name,
        eigenvalues=dynamics.eigenvalues,
        normal_form=fit.normal_form,
        chart=fit.chart,
        inverse_chart=fit.inverse_chart,
        scale=dynamics.scale,
        displacement=maps[0],
        velocity=maps[1],
        sensors=sensor_names,
        inputs=() if loads is None else loads.inputs,
        input_units=() if loads is None else loads.units,
        input_matrix=(dynamics.inverse @ force).astype(np.complex128),
        internal_resonance=fit.resonance.internal_resonance,
        trained_amplitude=np.abs(z).max(axis=0),
    )


def trajectory_error(
    model: ReducedModel, r: ReducedTrajectory, trajectory: Trajectory, full: Manifold | None
) -> TrajectoryError:
    """Simulate from the first window of a trajectory and compare with all of it."""
    z0, z = _from_first_window(model, r)
    finite = np.isfinite(z).all()
    predicted = sensors(model, z)[0]
    sensor_error = nmte_percent(r.displacement, predicted) if finite else float("inf")
    error = sensor_error
    if finite and full is not None and trajectory.snapshots is not None and trajectory.snapshot_index is not None:
        rows, snapshots = _snapshot_rows(trajectory, r)
        error = nmte_blocks(full, snapshots, coordinates(model, z)[rows])
    static = nmte_percent(r.displacement, evaluate(model.displacement, r.y / model.scale))
    return TrajectoryError(r.name, error, sensor_error, static, z0, r.t, r.displacement, predicted)


def _from_first_window(model: ReducedModel, r: ReducedTrajectory) -> tuple[ComplexArray, ComplexArray]:
    """Return the start and the motion of the model, nan from a divergence on."""
    try:
        z0 = fitted_start(model, r)
    except NumericalError:
        z0 = initial_state(model, r.y[0])
    return z0, free_motion(model, r.t, z0)


def _snapshot_rows(trajectory: Trajectory, r: ReducedTrajectory) -> tuple[IntArray, npt.NDArray[np.float32]]:
    """Return the rows of r of the snapshots that start_time left, and these snapshots."""
    assert trajectory.snapshots is not None
    assert trajectory.snapshot_index is not None
    first = len(trajectory.t) - len(r.t)
    keep = trajectory.snapshot_index >= first
    return trajectory.snapshot_index[keep] - first, trajectory.snapshots[keep]


def _full_field(
    training: Sequence[Trajectory], reduced: Sequence[ReducedTrajectory], model: ReducedModel, settings: LearnSettings
) -> Manifold | None:
    if any(trajectory.snapshots is None for trajectory in training):
        return None
    order = settings.geometry_order or FIELD_ORDER
    fit: ManifoldFit | None = None
    for trajectory, r in zip(training, reduced, strict=True):
        rows, snapshots = _snapshot_rows(trajectory, r)
        if fit is None:
            fit = ManifoldFit(snapshots.shape[1], exponents(r.y.shape[1], 1, order), model.scale)
        fit.add(snapshots, r.y[rows])
    return None if fit is None else fit.finish(settings.ridge)


def _is_modal(trajectories: Sequence[Trajectory]) -> bool:
    return all(trajectory.eta_ddot is not None for trajectory in trajectories)


def _columns(trajectory: Trajectory, settings: LearnSettings) -> list[int]:
    """Return the columns of eta of the master modes; all of them where only master modes were recorded."""
    m = len(settings.master_modes)
    recorded = 0 if trajectory.eta is None else trajectory.eta.shape[1]
    return list(range(m)) if recorded == m else [mode - 1 for mode in settings.master_modes]


def _check(training: Sequence[Trajectory], validation: Sequence[Trajectory], loads: Loads | None) -> None:
    if not training:
        raise InputError("no training trajectory", where="learn")
    for trajectory in [*training, *validation]:
        if trajectory.sensors != training[0].sensors:
            raise InputError("other sensors", where=f"trajectory '{trajectory.name}'", value=trajectory.sensors)
    if loads is not None and not _is_modal(training):
        raise InputError("modal loads need trajectories with modal fields", where="learn", value=loads.inputs)


def _notes(trajectories: Sequence[Trajectory], chart: SensorChart | None) -> tuple[str, ...]:
    if chart is None:
        return ()
    notes = [
        f"trajectory '{trajectory.name}' was resampled to a step of {chart.step:.6g} s"
        for trajectory in trajectories
        if not is_uniform(trajectory.t, chart.step)
    ]
    if chart.delays > 1:
        notes.append(f"too few sensors for {len(chart.frequency_hz)} modes: {chart.delays} delays were used")
    return tuple(notes)
