"""The learning stage: from trajectories to a reduced model with its errors on held-out motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from romgen.arrays import FloatArray
from romgen.chart import ReducedTrajectory, SensorChart, modal_chart, sensor_chart
from romgen.errors import InputError
from romgen.learning_notes import choice_sentence, learning_notes
from romgen.manifold import Manifold, ManifoldFit
from romgen.normal_form import NormalFormFit, fit_normal_form, with_replicates
from romgen.order_selection import OrderTable, choose_order
from romgen.polynomial import PolynomialMap, exponents
from romgen.reduced_dynamics import LinearPart
from romgen.reduced_model import ReducedModel
from romgen.sensor_modes import learn_sensor_chart
from romgen.settings import LearnSettings
from romgen.stability import tried_stability
from romgen.trajectory import Trajectory, check_magnitude
from romgen.trajectory_error import TrajectoryError, snapshot_rows, trajectory_error
from romgen.trajectory_fit import fit_on_trajectories

# The full field and the sensors are nearly linear plus quadratic in y. Higher terms lower the static error by less than
# a hundredth of the error of the motion, cost n_dof numbers each, and grow beyond all bounds outside the range.
FIELD_ORDER = 3


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
class Learned:
    """A reduced model, how it was made, and what it gets wrong.

    Attributes
    ----------
    model : everything downstream reads this.
    fit : normal form with resonance table, cost, coefficient deviations.
    chart : chart of sensor data; None with modal coordinates.
    full_field : manifold of all degrees of freedom; None without snapshots.
    order : of the normal form; orders : how order and method were chosen, or the method alone for a given order.
    training, validation : errors; nothing of the validation trajectories enters the model.
    choice : order and method of the normal form with the errors that decided.
    notes : what was resampled or left out, which motions diverge.
    """

    model: ReducedModel
    fit: NormalFormFit
    chart: SensorChart | None
    full_field: Manifold | None
    order: int
    orders: OrderTable
    training: tuple[TrajectoryError, ...]
    validation: tuple[TrajectoryError, ...]
    choice: str
    notes: tuple[str, ...]


def learn(
    training: Sequence[Trajectory],
    validation: Sequence[Trajectory],
    settings: LearnSettings,
    name: str,
    loads: Loads | None = None,
    known: LinearPart | None = None,
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
    known : linear part of the master modes to keep; only with modal fields, None fits it.

    Raises
    ------
    InputError : no training trajectory, different sensors, or loads or a linear part without modal fields.
    NumericalError : the data are not those of decaying oscillations.
    """
    _check(training, validation, loads, known)
    chart = None if _is_modal(training) else _sensor_chart(training, settings.master_modes)
    reduced = [reduced_trajectory(trajectory, chart, settings) for trajectory in training]
    orders = choose_order(reduced, settings, known)
    fit = best_fit(reduced, orders, settings, known)
    model = assemble(name, fit, reduced, settings, training[0].sensors, loads)
    full = _full_field(training, reduced, model, settings)
    held_out = [reduced_trajectory(trajectory, chart, settings) for trajectory in validation]
    pairs = zip([*reduced, *held_out], [*training, *validation], strict=True)
    errors = tuple(trajectory_error(model, r, trajectory, full) for r, trajectory in pairs)
    return Learned(
        model=model,
        fit=fit,
        chart=chart,
        full_field=full,
        order=orders.order,
        orders=orders,
        training=errors[: len(training)],
        validation=errors[len(training) :],
        choice=choice_sentence(orders, fit.origin),
        notes=learning_notes([*training, *validation], chart, model, errors, fit.origin),
    )


def _sensor_chart(training: Sequence[Trajectory], modes: Sequence[int]) -> SensorChart:
    """Return the chart of the modes with these numbers, from 1: all up to the highest are identified."""
    return learn_sensor_chart(training, max(modes)).of_modes([mode - 1 for mode in sorted(modes)])


def best_fit(
    training: Sequence[ReducedTrajectory], table: OrderTable, settings: LearnSettings, known: LinearPart | None = None
) -> NormalFormFit:
    """Return the normal form of all training data by the order and method of the table, with its replicates."""
    method = fit_normal_form if table.method == "conjugacy" else fit_on_trajectories
    fit = method(training, table.order, settings.internal_resonance, settings.ridge, known)
    return with_replicates(fit, training, settings.ridge, keep_linear=known is not None)


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
    training : gives the sensor maps.
    """
    y = np.vstack([r.y for r in training])
    dynamics = fit.dynamics
    m = len(dynamics.eigenvalues)
    table, maps = exponents(2 * m, 1, settings.geometry_order or FIELD_ORDER), []
    for x in (np.vstack([r.displacement for r in training]), np.vstack([r.velocity for r in training])):
        regression = ManifoldFit(x.shape[1], table, dynamics.scale)
        regression.add(x, y)
        maps.append(PolynomialMap(table, regression.finish(settings.ridge).coefficients))
    modal_load = np.zeros((m, 0)) if loads is None else loads.modal_load
    force = np.vstack([np.zeros_like(modal_load), modal_load]) / dynamics.scale[:, None]
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
        trained_amplitude=fit.trained_range.amplitude,
        trained_facets=fit.trained_range.facets,
        stability=tried_stability(dynamics.eigenvalues, fit.normal_form, fit.trained_range),
    )


def _full_field(
    training: Sequence[Trajectory], reduced: Sequence[ReducedTrajectory], model: ReducedModel, settings: LearnSettings
) -> Manifold | None:
    if any(trajectory.snapshots is None for trajectory in training):
        return None
    order = settings.geometry_order or FIELD_ORDER
    fit: ManifoldFit | None = None
    for trajectory, r in zip(training, reduced, strict=True):
        rows, snapshots = snapshot_rows(trajectory, r)
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


def _check(
    training: Sequence[Trajectory],
    validation: Sequence[Trajectory],
    loads: Loads | None,
    known: LinearPart | None,
) -> None:
    if not training:
        raise InputError("no training trajectory", where="learn")
    for trajectory in [*training, *validation]:
        if trajectory.sensors != training[0].sensors:
            raise InputError("other sensors", where=f"trajectory '{trajectory.name}'", value=trajectory.sensors)
        check_magnitude(trajectory.displacement, f"trajectory '{trajectory.name}'")
    if loads is not None and not _is_modal(training):
        raise InputError("modal loads need trajectories with modal fields", where="learn", value=loads.inputs)
    if known is not None and not _is_modal(training):
        raise InputError("a linear part needs trajectories with modal fields", where="learn", value=known.omega)
