"""Static equilibrium under loads, moved supports and tightened bolts, with contact and friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem.arrays import FloatArray
from fem.bolt import warn_of_slack
from fem.bounds import require, require_count
from fem.contact import ContactState
from fem.errors import FemConvergenceError, FemInputError
from fem.finite_values import as_numbers, finite_array
from fem.friction_work import friction_work
from fem.model import Model
from fem.newton import LoadStep, Target, Tolerance, internal_force
from fem.reach import warn_of_reach
from fem.rigid_motion import check_restraint, loose_bodies, loose_motion
from fem.sliding import sliding_motion, warn_of_sliding

Progress = Callable[[float], None]

_EASY = 6
"""Iterations of a load step after which the next one may be twice as long again."""


@dataclass(frozen=True)
class StaticState:
    """A converged equilibrium.

    Attributes
    ----------
    u : (n_dof,) m.
    contact : tractions, slip and status of all points, one case.
    load_factors : converged load factors; residuals : relative residual of every iteration of every step.
    dissipated : (n_point,) work of friction on the way, J/m^2, second order in the load steps (``friction_work``); None
        where it was not kept.
    follower : share of the follower pressures of the model that acts here.
    """

    u: FloatArray
    contact: ContactState
    load_factors: tuple[float, ...]
    residuals: tuple[float, ...]
    dissipated: FloatArray | None = None
    follower: float = 0.0

    def check_belongs(self, model: Model) -> None:
        """Raise ``FemInputError`` where this is no state of the model: other nodes or contact points."""
        wanted, seen = (model.n_dof, model.contact.n_point), (np.size(self.u), len(self.contact.slip))
        if wanted != seen:
            value = (
                f"{seen[0]} degrees of freedom and {seen[1]} contact points, the model has {wanted[0]} and {wanted[1]}"
            )
            raise FemInputError("the state belongs to another model", where="equilibrium", value=value)
        finite_array(self.u, (model.n_dof,), "the displacement", where="equilibrium")


@dataclass(frozen=True)
class StaticSettings:
    """How to load.

    Attributes
    ----------
    steps : equal load steps; a step that fails is halved, up to ``cuts`` times.
    tolerance : residual relative to the load, or what rounding leaves of it, see ``roundoff``.
    max_iterations : per step; solver : linear solver by name.
    """

    steps: int = 4
    tolerance: float = 1e-8
    max_iterations: int = 30
    solver: str = "auto"
    cuts: int = 6

    def __post_init__(self) -> None:
        require_count("static settings", "steps", self.steps, 1)
        require_count("static settings", "max_iterations", self.max_iterations, 1)
        require_count("static settings", "cuts", self.cuts, 0)
        require("static settings", "tolerance", self.tolerance, 0.0, above=True)


def solve_static(
    model: Model,
    load: FloatArray,
    settings: StaticSettings,
    *,
    start: StaticState | None = None,
    progress: Progress | None = None,
) -> StaticState:
    """Load-stepped Newton with line search: f_int(u) + f_contact(u, slip) = load, u = prescribed where a support holds.

    Bolts keep the shortening at which they are locked, none in a new model, which a ``PreloadWarning`` says:
    ``solve_preload`` tightens them.

    Parameters
    ----------
    load : (n_dof,) N at the end; the steps go from the load that ``start`` carries (none: zero) to it, and from its
        displacement of the supports to the prescribed one. Follower pressures go to those of the model, see
        ``Model.following``, and turn with the surface in every iteration.
    start : equilibrium to start from, with its slip history.

    Raises
    ------
    FemConvergenceError : with the residual history; what converged before is in ``last_good`` of the error.
    FemInputError : a body that nothing holds, an interface that never closes, or a load that is not finite.

    Issues ``SlidingWarning`` and ``ReachWarning``.
    """
    warn_of_slack(model.bolts, "static solution")
    return _Loading(model, load, settings, start, tightened=False).run(progress)[0]


def solve_preload(
    model: Model, settings: StaticSettings, *, progress: Progress | None = None
) -> tuple[Model, StaticState]:
    """The equilibrium under ``model.load`` with all bolts tightened to their forces, and the model with bolts locked.

    The shortening of every bolt grows with the load factor so that its force does; at the end each has the force asked
    for, whatever the others did to it. Everything after goes on with the returned model: its bolts are springs then.
    Raises as ``solve_static``.
    """
    if not model.bolts.bolts:
        return model, solve_static(model, model.load, settings, progress=progress)
    state, shortening = _Loading(model, model.load, settings, None, tightened=True).run(progress)
    return lock_bolts(model, shortening), state


def lock_bolts(model: Model, shortening: FloatArray) -> Model:
    """The model with its bolts shortened by (n_bolt,) m for good: their pull joins the load."""
    shortening = finite_array(shortening, (len(model.bolts.bolts),), "the shortening", where="bolts")
    change = shortening - model.bolts.shortening
    bolts = replace(model.bolts, shortening=shortening)
    return replace(model, load=model.load - change @ model.bolts.pull, bolts=bolts)


def nodal_load(model: Model, load: FloatArray) -> FloatArray:
    """The load (n_dof,) N; another shape and numbers that are not finite raise ``FemInputError``."""
    given = as_numbers(load, "the load", where="load")
    if given.shape != (model.n_dof,):
        advice = f"give {model.n_dof} nodal forces, such as model.load"
        raise FemInputError("the load has the wrong shape", where="load", value=given.shape, advice=advice)
    if not np.isfinite(given).all():
        node, axis = divmod(int(np.flatnonzero(~np.isfinite(given))[0]), 3)
        raise FemInputError("the load is not finite", where=f"node {node}, direction {'xyz'[axis]}")
    return given


class _Loading:
    """A path of load steps with cut-back."""

    def __init__(
        self, model: Model, load: FloatArray, settings: StaticSettings, start: StaticState | None, *, tightened: bool
    ) -> None:
        check_restraint(model)
        load = nodal_load(model, load)
        if start is not None:
            start.check_belongs(model)
        self._share = 0.0 if start is None else start.follower
        carried, followers = model.following(self._share), model.followers
        self._model, self._load, self._settings, self._tightened = model, load, settings, tightened
        self._fresh = start is None
        self._u = np.zeros(model.n_dof) if start is None else start.u
        self._begin = self._u
        slip = model.contact.no_slip(1) if start is None else start.contact.slip
        self._first, self._contact = internal_force(carried, self._u, slip)
        if start is None:
            self._first = np.zeros(model.n_dof)
        self._shortening = model.bolts.shortening
        wanted = model.bolts.wanted if tightened else np.zeros(0)
        # Not the change alone: a start that is already in balance would ask for a residual below roundoff.
        pressed = followers.force(self._u[:, None])[:, 0] if followers.any else np.zeros(model.n_dof)
        sizes = [float(np.linalg.norm(force[model.free])) for force in (load, self._first, pressed)]
        scale = max(*sizes, float(np.linalg.norm(wanted))) or 1.0
        self._tolerance = Tolerance(settings.tolerance, scale, settings.max_iterations, settings.solver)
        self._dissipated = np.zeros(model.contact.n_point)
        self._factors: list[float] = []

    def run(self, progress: Progress | None) -> tuple[StaticState, FloatArray]:
        """March the load factor to 1; the state and the shortening of the bolts there."""
        settings, factor = self._settings, 0.0
        increment, cuts = 1.0 / settings.steps, 0
        while factor < 1.0:
            # Whole steps are counted, not added up: four steps end at exactly 1.
            whole = round((factor + increment) * settings.steps) / settings.steps
            next_factor = min(whole if cuts == 0 else factor + increment, 1.0)
            count = len(self._tolerance.history)
            try:
                self._advance(factor, next_factor)
            except FemConvergenceError as error:
                cuts += 1
                increment = 0.5 * (next_factor - factor)
                if cuts > settings.cuts:
                    raise self._failure(error, factor) from error
                continue
            factor = next_factor
            self._factors.append(factor)
            if cuts > 0 and len(self._tolerance.history) - count <= _EASY:
                cuts, increment = cuts - 1, 2.0 * increment
            if progress is not None:
                progress(factor)
        contact = self._model.contact
        motion = sliding_motion(contact, contact.relative(self._u[:, None]), self._contact.status)
        warn_of_sliding(contact, motion)
        warn_of_reach(contact.names, contact.left_out, contact.left_out.depth(self._u[:, None]))
        return self._state(), self._shortening

    def _advance(self, old: float, new: float) -> None:
        model = self._model
        held = np.where(model.free, 0.0, self._begin + new * (model.prescribed - self._begin) - self._u)
        target = Target(
            self._first + new * (self._load - self._first),
            held,
            new * model.bolts.wanted if self._tightened else None,
            touching=self._fresh and old == 0.0,
        )
        slip = self._contact.slip
        share = self._share + new * (model.followers.factor - self._share)
        found = LoadStep(model.following(share), target, slip, self._tolerance).solve(self._u, self._shortening)
        relative = (model.contact.relative(self._u[:, None]), model.contact.relative(found.u[:, None]))
        self._dissipated += friction_work(model.contact, relative, (self._contact, found.contact))
        self._u, self._shortening, self._contact = found.u, found.shortening, found.contact

    def _state(self) -> StaticState:
        history = tuple(self._tolerance.history)
        reached, share = self._factors[-1] if self._factors else 0.0, self._share
        share += reached * (self._model.followers.factor - share)
        return StaticState(self._u, self._contact, tuple(self._factors), history, self._dissipated.copy(), share)

    def _advice(self, contact: object) -> str:
        """What the last iterate says about the failure: a part that all its closed points let slide, or nothing."""
        if isinstance(contact, ContactState):
            status = contact.status[:, 0]
            share = loose_motion(self._model, status > 0, status == 2)
            if share is not None and (status == 2).any():
                slides = loose_bodies(self._model, share)
                return f"friction does not hold {slides} under this load; use less load, more friction or a support"
        return "use more load steps, or check supports and gaps of the loose part"

    def _failure(self, error: FemConvergenceError, factor: float) -> FemConvergenceError:
        names, pair = self._model.contact.names, self._model.contact.pair
        counts = [np.bincount(self._contact.status[pair == n, 0], minlength=3) for n in range(len(names))]
        status = "; ".join(
            f"{name} {c[0]} open, {c[1]} stick, {c[2]} slip" for name, c in zip(names, counts, strict=True)
        )
        failure = FemConvergenceError(
            error.what,
            where=error.where,
            value=f"load factor {factor:.4g} reached, then {error.value}; contact there: {status or 'none'}",
            advice=self._advice(error.last_contact),
            history=tuple(self._tolerance.history),
        )
        failure.last_good = self._state()
        return failure
