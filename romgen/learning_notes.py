"""What a user should know about how a model was learned, one sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import SensorChart
from romgen.differences import is_uniform
from romgen.normal_form import FitOrigin
from romgen.order_selection import OrderTable
from romgen.reduced_model import ReducedModel
from romgen.trajectory import Trajectory
from romgen.trajectory_error import TrajectoryError

# Share of the largest motion; an offset of one percent is as large as the error aimed at.
NOTED_REST_PERCENT = 1.0
# Differences of order 8 err by (2 pi / 7)^8 / 630 = 7e-4 of a derivative with so many samples in a period.
SAMPLES_PER_PERIOD = 7.0
# Starts that the training motions nearly reach are not worth a note.
NOTED_DISTANCE = 1.05
_TIES = {
    "given": "as given",
    "small motions": "tied to the samples in which all modes are small",
    "all amplitudes": "tied to a regression over all amplitudes",
    "the direct fit": "tied to that of the direct fit",
}


def learning_notes(
    trajectories: Sequence[Trajectory],
    chart: SensorChart | None,
    model: ReducedModel,
    errors: Sequence[TrajectoryError],
    origin: FitOrigin | None = None,
) -> tuple[str, ...]:
    """Return what was resampled, whether the model decays in its range, and which motions it cannot follow and why.

    Parameters
    ----------
    trajectories : all, training first.
    chart : None with modal coordinates.
    errors : of the model on all trajectories.
    origin : of a fit on trajectories.
    """
    return (
        *_chart_notes(trajectories, chart),
        *_linear_part(origin),
        *_stability(model),
        *_divergences(model, errors),
        *_outside(model, errors),
        *_rests(errors),
    )


def _chart_notes(trajectories: Sequence[Trajectory], chart: SensorChart | None) -> Iterator[str]:
    if chart is None:
        return
    for trajectory in trajectories:
        if not is_uniform(trajectory.t, chart.recorded_step):
            yield f"trajectory '{trajectory.name}' was resampled to a step of {chart.recorded_step:.6g} s"
    if chart.low_pass is not None:
        yield (
            f"the sensors carry noise of {100 * chart.low_pass.noise:.2g} % of the largest motion, which derivatives "
            f"would enlarge: they were smoothed above {chart.low_pass.pass_hz:.4g} Hz, where no spectral line stands "
            f"out of it, and every {chart.step:.4g} s is used; errors are those of the recorded samples"
        )
    if chart.doubt:
        yield (
            f"{chart.doubt}: the chart may be wrong; check the number of master modes, the sampling and the noise, or "
            "give longer decays"
        )
    samples = 1.0 / (chart.step * float(np.max(chart.frequency_hz)))
    if samples < SAMPLES_PER_PERIOD:
        yield (
            f"the fastest mode found, {np.max(chart.frequency_hz):.4g} Hz, has only {samples:.2g} samples in a period: "
            "derivatives are wrong, and faster modes may pass for slower ones; sample faster"
        )
    if chart.delays > 1:
        n_mode = len(chart.frequency_hz)
        few = chart.projection.shape[1] // chart.delays < n_mode
        why = f"too few sensors for {n_mode} modes" if few else f"sensors too similar or too noisy for {n_mode} modes"
        yield f"{why}: {chart.delays} delays were used"


def choice_sentence(orders: OrderTable, origin: FitOrigin | None = None) -> str:
    """Return order and method of the normal form with the errors that decided, and where the fit came from."""
    rows = zip(orders.tried, orders.methods, orders.nmte_percent, orders.stable, strict=True)
    tried = ", ".join(
        f"order {order} on {method} {error:.3g} %" + ("" if stable else " (not stable in its range)")
        for order, method, error, stable in rows
    )
    came = "" if origin is None else f" from {origin.start}, its linear part {_TIES[origin.linear]}"
    return (
        f"normal form of order {orders.order} fitted on {orders.method}{came}: "
        f"mean NMTE of held-out blocks of the training data was {tried}"
    )


def _divergences(model: ReducedModel, errors: Sequence[TrajectoryError]) -> Iterator[str]:
    for error in errors:
        if not np.isfinite(error.nmte_percent):
            distance = float(model.trained_range.distance(error.start[None])[0])
            guess = "" if error.start_fitted else " (of its first sample: it diverges within the first periods)"
            yield (
                f"the model diverges on '{error.name}' at t = {error.diverged_s:.4g} s: it starts at abs(z) = "
                f"{_numbers(error.start)}{guess}, {distance:.3g} times the trained range, trained were "
                f"{_numbers(model.trained_amplitude)}; "
                "train on motions that reach these amplitudes, or lower [learn] order"
            )


def _stability(model: ReducedModel) -> Iterator[str]:
    tried = model.stability
    if tried is not None and not tried.is_stable:
        yield (
            f"the model is not stable in its trained range: {100 * (1 - tried.share[0]):.0f} % of {tried.starts} free "
            "motions from the boundary of the range do not decay; add training motions in which several modes are "
            "large at once, or lower [learn] order"
        )


def _linear_part(origin: FitOrigin | None) -> Iterator[str]:
    if origin is not None and origin.linear == "all amplitudes":
        yield (
            "the training motions end, or do not decay, before all modes are small together for 20 periods: frequency "
            "and damping of small motions are extrapolated from larger ones; record longer ring-downs"
        )


def _outside(model: ReducedModel, errors: Sequence[TrajectoryError]) -> Iterator[str]:
    for error in errors:
        distance = float(model.trained_range.distance(error.start[None])[0])
        if np.isfinite(error.nmte_percent) and distance > NOTED_DISTANCE:
            yield (
                f"trajectory '{error.name}' starts at {distance:.2f} times the trained range: its error is that of an "
                "extrapolation"
            )


def _rests(errors: Sequence[TrajectoryError]) -> Iterator[str]:
    for error in errors:
        if error.rest_percent > NOTED_REST_PERCENT:
            yield (
                f"trajectory '{error.name}' comes to rest {error.rest_percent:.2g} % of its largest motion off the "
                "equilibrium (residual slip, or an offset of the sensors); the model decays to zero and misses late "
                'samples by this much; [data] zero = "rest" counts recorded motions from where they come to rest'
            )


def _numbers(z: ComplexArray | FloatArray) -> str:
    return "(" + ", ".join(f"{abs(value):.3g}" for value in z) + ")"
