"""From a fit to one that dissipates in and around its range.

Levenberg-Marquardt goes on from the fit with the penalty of ``dissipation``. Where that is so large at first that the
steps follow it away from the data, the demand is first met on the quadratic model of the cost,

    minimise over the change c:  2 g'c + c'H c + penalty(c),

H the Gauss-Newton matrix with initial states and priors: the penalty is a sum of squares of hinges that are linear in
c, so Newton steps on it cost no simulation, and the change goes where the data say least. Where dissipation takes more
than CONFLICT of the cost (and more than the relative misfit at which priors count), it is demanded in the range alone,
and where that takes as much, the fit stays as it is: its data do not support it, and its free decays will tell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from romgen.dissipation import SHELLS, demand
from romgen.refined_dynamics import RefinedDynamics, Segment, simulated
from romgen.refinement import PRIOR_ERROR, growth, linearise, moved, refine
from romgen.trained_range import trained_range

STEPS, DECREASE = 15, 1e-4
# Newton steps on the quadratic model, its relative decrease at the end, and halvings of a step.
PROJECTION_STEPS, PROJECTION_DECREASE, HALVINGS = 60, 1e-6, 12
# Share of the cost that dissipation beyond the data may take: a relative misfit larger by a twentieth.
CONFLICT = 0.1


def dissipative(
    model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """Return model and segments refined with dissipation demanded around what the model passes through.

    Parameters
    ----------
    model : a fit without demand, at its optimum; segments : its motions.
    max_step : internal step of the simulation, s.
    """
    z = np.vstack([run[s.kept] for run, s in zip(simulated(model, segments, max_step), segments, strict=True)])
    if not np.isfinite(z).all():
        return model, segments
    trained, limit = trained_range(z), (1.0 + CONFLICT) * model.cost + PRIOR_ERROR**2
    for shells in (SHELLS, tuple(shell for shell in SHELLS if shell[0] <= 1.0)):
        demanding = replace(model, demand=demand(trained, model.reference, shells), cost=float("inf"))
        if growth(demanding)[0] == 0.0:
            return model, segments
        found, own = refine(demanding, segments, max_step, STEPS, DECREASE)
        if found.cost > limit:
            found, own = refine(*projected(demanding, segments, max_step), max_step, STEPS, DECREASE)
        if found.cost <= limit:
            return found, own
    return model, segments


def projected(
    model: RefinedDynamics, segments: tuple[Segment, ...], max_step: float
) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """Return model and segments at the minimum of the quadratic model of the cost plus the penalty."""
    here = linearise(replace(model, demand=None), segments, max_step)
    H, g = here.hessian, here.gradient
    change = np.zeros(len(g))
    value = growth(model)[0]
    # kept eigenvalues do not change
    first = 2 * len(model.eigenvalues) if model.keep_linear else 0
    for _ in range(PROJECTION_STEPS):
        _, slope, curvature = growth(moved(model, segments, change)[0])
        n = len(slope)
        gradient, total = H @ change + g, H.copy()
        gradient[:n] += slope
        total[:n, :n] += curvature
        step = np.zeros(len(g))
        step[first:] = -np.linalg.solve(total[first:, first:], gradient[first:])
        for halved in range(HALVINGS):
            trial = change + 0.5**halved * step
            reached = float(trial @ (H @ trial + 2.0 * g)) + growth(moved(model, segments, trial)[0])[0]
            if reached < value:
                break
        else:
            break
        gain, change, value = value - reached, trial, reached
        if gain <= PROJECTION_DECREASE * abs(value):
            break
    return moved(model, segments, change)
