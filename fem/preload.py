"""Static equilibrium under the clamping loads, with contact and friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.contact import ContactState
from fem.errors import FemConvergenceError, FemInputError
from fem.linear_solver import make_solver
from fem.model import Model
from fem.rigid_motion import check_restraint

Progress = Callable[[float], None]

_ROUNDOFF = 1e-14
"""Share of the forces inside a body that cancellation leaves in its residual."""


@dataclass(frozen=True)
class StaticState:
    """A converged equilibrium.

    Attributes
    ----------
    u : (n_dof,) m.
    contact : tractions, slip and status of all points, one case.
    load_factors : converged load factors; residuals : relative residual of every iteration of every step.
    """

    u: FloatArray
    contact: ContactState
    load_factors: tuple[float, ...]
    residuals: tuple[float, ...]


@dataclass(frozen=True)
class StaticSettings:
    """Number of equal load steps, relative residual, iterations per step, linear solver by name."""

    steps: int = 4
    tolerance: float = 1e-8
    max_iterations: int = 30
    solver: str = "auto"


def solve_static(
    model: Model,
    load: FloatArray,
    settings: StaticSettings,
    *,
    start: StaticState | None = None,
    progress: Progress | None = None,
) -> StaticState:
    """Load-stepped Newton with line search: f_int(u) + f_contact(u, slip) = load, u = prescribed where a support holds.

    Parameters
    ----------
    load : (n_dof,) N at the end; the steps go from the load that ``start`` carries (none: zero) to it, and from its
        displacement of the supports to the prescribed one.
    start : equilibrium to start from, with its slip history.

    Raises
    ------
    FemConvergenceError : with the residual history; what converged before is in ``last_good`` of the error.
    FemInputError : a body that nothing holds, or a load that is not finite.
    """
    check_restraint(model)
    if not np.isfinite(load).all():
        node, axis = divmod(int(np.flatnonzero(~np.isfinite(load))[0]), 3)
        raise FemInputError("the load is not finite", where=f"node {node}, direction {'xyz'[axis]}")
    n_case = 1
    held = np.where(model.free, 0.0, model.prescribed)
    u = np.zeros(model.n_dof) if start is None else start.u
    slip = model.contact.no_slip(n_case) if start is None else start.contact.slip
    first = np.zeros(model.n_dof) if start is None else _internal(model, u, slip)[0]
    # Not the change alone: a start that is already in balance would ask for a residual below roundoff.
    scale = max(float(np.linalg.norm(force[model.free])) for force in (load, first)) or 1.0
    factors: list[float] = []
    history: list[float] = []
    state = model.contact.evaluate(model.contact.relative(u[:, None]), slip)
    for step in range(1, settings.steps + 1):
        factor = step / settings.steps
        target = first + factor * (load - first)
        # The part of the way to the prescribed displacement that is left shrinks to nothing in the last step.
        moved = np.where(model.free, 0.0, (held - u) / (settings.steps + 1 - step))
        touching = start is None and step == 1
        try:
            u, state = _newton(model, target, moved, u, state.slip, scale, settings, history, touching)
        except FemConvergenceError as error:
            error.last_good = StaticState(u, state, tuple(factors), tuple(history))
            raise
        factors.append(factor)
        if progress is not None:
            progress(factor)
    return StaticState(u, state, tuple(factors), tuple(history))


def _internal(model: Model, u: FloatArray, slip: FloatArray) -> tuple[FloatArray, ContactState]:
    state = model.contact.evaluate(model.contact.relative(u[:, None]), slip)
    force = model.elastic_force(u[:, None])[0] + model.contact.force(state.traction)
    return force[:, 0], state


def _newton(
    model: Model,
    load: FloatArray,
    moved: FloatArray,
    u: FloatArray,
    slip: FloatArray,
    scale: float,
    settings: StaticSettings,
    history: list[float],
    touching: bool,
) -> tuple[FloatArray, ContactState]:
    """One load step; ``touching`` starts with all points stuck, since surfaces that just touch carry nothing yet.

    The first iteration moves the supports by ``moved`` and the rest with them by the tangent, in full length.
    """
    force, state = _internal(model, u, slip)
    residual = np.where(model.free, load - force, 0.0)
    driven = bool(moved.any())
    for iteration in range(settings.max_iterations):
        norm = float(np.linalg.norm(residual)) / scale
        history.append(norm)
        driving = driven and iteration == 0
        if norm <= settings.tolerance and not driving:
            return u, state
        if touching and iteration == 0:
            contact = model.contact.stick_tangent(np.ones(model.contact.n_point, dtype=np.int64))
        else:
            contact = model.contact.tangent(u, slip[:, :, 0])
        full = model.elastic_tangent(u) + contact
        tangent = model.constrain(full)
        solver = make_solver(settings.solver, symmetric=False)
        solver.analyse(tangent)
        solver.factor(tangent)
        step = solver.solve(np.where(model.free, residual - full @ moved, moved) if driving else residual)
        lengths = (1.0,) if driving else (1.0, 0.5, 0.25, 0.125)
        u, residual, state = _line_search(model, load, u, slip, step, norm * scale, lengths=lengths)
        if driving:
            # Without loads the reactions measure the residual; a rigid motion has none and leaves what roundoff leaves.
            roundoff = _ROUNDOFF / settings.tolerance * float(np.linalg.norm(full @ moved))
            reaction = float(np.linalg.norm(_internal(model, u, slip)[0][~model.free]))
            scale = max(scale if load.any() else 0.0, reaction, roundoff)
    raise FemConvergenceError(
        "no static equilibrium",
        where="preload",
        value=f"relative residual {history[-1]:.2e} after {settings.max_iterations} iterations",
        advice="use more load steps, or check supports and gaps of the loose part",
        history=tuple(history),
    )


def _line_search(
    model: Model,
    load: FloatArray,
    u: FloatArray,
    slip: FloatArray,
    step: FloatArray,
    norm: float,
    *,
    lengths: tuple[float, ...],
) -> tuple[FloatArray, FloatArray, ContactState]:
    """Halve the step until the residual falls; keep the best of the tried lengths."""
    best: tuple[float, FloatArray, FloatArray, ContactState] | None = None
    for length in lengths:
        trial = u + length * step
        force, state = _internal(model, trial, slip)
        residual = np.where(model.free, load - force, 0.0)
        size = float(np.linalg.norm(residual))
        if best is None or size < best[0]:
            best = (size, trial, residual, state)
        if size < norm:
            break
    assert best is not None
    return best[1], best[2], best[3]
