"""The size of the next time step: halvings of the output interval, by failure and by a local error estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem.arrays import BoolArray, FloatArray, IntArray
from fem.dynamics import Dynamics
from fem.errors import FemConvergenceError
from fem.generalized_alpha import Scheme
from fem.interface_equilibrium import loosened
from fem.modes import ModalBasis
from fem.motion import MotionState, Pace, StepRecord
from fem.step_equation import StepEquation

GROW = 0.1
"""Local error over its tolerance below which the next step may be twice as long: 2^-3, less a margin."""

EASY = 3
"""A step is easy, and the next one may be longer, up to the largest number of iterations over this."""

REFRESH_WAIT = 10
"""Steps that a factor of its own must serve a case to have paid: it costs as much as some 40 iterations."""

WORTH = 0.8
"""Share of the iterations for which a factor was made that a step with it may take for the factor to stay."""


RIGID = 1e-3
"""Share of the highest frequency of the basis below which a mode is one of a free body and has no deflection."""


@dataclass(frozen=True)
class StepControl:
    """What sizes are allowed and what local error.

    Attributes
    ----------
    finest : most halvings of the output interval; coarsest : fewest, negative for steps of several intervals.
    error_tolerance : local error of a step in the mass norm of u over the largest displacement so far, or over what
        the present load would deflect where that is more, as it is from rest; None: fixed.
    max_iterations : of a step. refactor_above : iterations above which a case gets a factor of its own; 0: never.
    apart : points that slip or open are taken for the equilibrium of their own.
    """

    finest: int
    coarsest: int
    error_tolerance: float | None
    max_iterations: int
    refactor_above: int
    apart: bool

    def error(self, equation: StepEquation, old: MotionState, record: StepRecord, deflection: FloatArray) -> float:
        """Largest local error over its tolerance of all cases; 0 where steps are fixed.

        ``deflection`` (n_case,) by the present load, and of what is noise, in the mass norm.

        e = (b + (am - af)/2 - 1/6) h^2 (a_(n+1) - a_n): what a Taylor series adds to the u of the scheme, whose a
        belongs to the time t + (am - af) h. Zienkiewicz & Xie, Earthquake Eng. Struct. Dyn. 20 (1991) 871-887, eq. (12)
        for Newmark's method, where am = af = 0.
        """
        if self.error_tolerance is None:
            return 0.0
        s, new = equation.scheme, record.state
        factor = (s.beta + 0.5 * (s.alpha_m - s.alpha_f) - 1.0 / 6.0) * equation.step**2
        squared = np.einsum("nc,nc->c", new.a - old.a, new.inertia_a - old.inertia_a)
        scale = np.maximum(np.maximum(new.pace.peak, equation.dynamics.size(new.u)), deflection)
        error = abs(factor) * np.sqrt(np.maximum(squared, 0.0))
        # A case that rests with nothing acting on it has neither error nor scale.
        return float((error / np.where(scale > 0.0, scale, 1.0)).max() / self.error_tolerance)

    def next_level(self, level: int, position: float, error: float, iterations: int) -> int:
        """Level to try after a step of ``level`` that ended at ``position``."""
        coarser = level - 1
        fits = coarser >= self.coarsest and (position * 2.0**coarser).is_integer()
        calm = self.error_tolerance is None or error < GROW
        return coarser if fits and calm and iterations * EASY <= self.max_iterations else level

    def paced(self, dynamics: Dynamics, old: MotionState, record: StepRecord, level: int, error: float) -> StepRecord:
        """The record with the pace after an accepted step of ``level``."""
        new, iterations = record.state, record.effort.iterations
        position = old.pace.position + 2.0**-level
        peak = old.pace.peak if self.error_tolerance is None else np.maximum(old.pace.peak, dynamics.size(new.u))
        pace = replace(
            new.pace,
            position=position,
            level=self.next_level(level, position, error, int(iterations.max())),
            last_level=level,
            peak=peak,
            force=np.maximum(old.pace.force, dynamics.norm(new.inertia_a)),
            waited=old.pace.waited + 1,
            loose=self._loose(dynamics, old.pace.loose, record),
        )
        pace, count = self._refreshed(pace, iterations, new.u, old.slip)
        state = replace(new, step=int(np.floor(position)), pace=pace)
        effort = replace(record.effort, factors=record.effort.factors + count)
        return replace(record, state=state, resume=state, effort=effort)

    def _loose(self, dynamics: Dynamics, index: IntArray, record: StepRecord) -> IntArray:
        if not self.apart:
            return index
        closed = dynamics.equilibrium.contact.status[:, 0] > 0
        return loosened(index, dynamics.model.contact, record.contact, closed)

    def _refreshed(self, pace: Pace, iterations: IntArray, u: FloatArray, slip: FloatArray) -> tuple[Pace, int]:
        """The pace with new factors for slow cases, without those that did not pay, and the number of new ones.

        A factor that saves less than a fifth of the iterations for which it was made is dropped for the shared one. If
        that comes before ``REFRESH_WAIT`` steps it has not paid, and the case waits twice as long for the next.
        """
        if not self.refactor_above:
            return pace, 0
        stale = np.isin(np.arange(len(iterations)), pace.anchored) & (iterations > WORTH * pace.before)
        lost = np.maximum(2 * pace.patience, REFRESH_WAIT)
        patience = np.where(stale, np.where(pace.waited < REFRESH_WAIT, lost, 0), pace.patience)
        waited = np.where(stale, 0, pace.waited)
        pace = _dropped(replace(pace, patience=patience, waited=waited), stale)
        slow = (iterations > self.refactor_above) & (pace.waited >= pace.patience)
        if not slow.any():
            return pace, 0
        pace = replace(pace, before=np.where(slow, iterations, pace.before))
        return _anchored(pace, slow, u, slip), int(slow.sum())


def modal_deflection(modes: ModalBasis, load: FloatArray, rounding: float) -> FloatArray:
    """Mass norm of phi_j' p / omega_j^2 over the elastic modes, (n_case,) m kg^0.5; at least that of ``rounding`` N.

    Without it a motion from rest has nothing to compare its local error with.
    """
    elastic = modes.omega > RIGID * modes.omega.max(initial=0.0)
    compliance = modes.shapes[:, elastic] / modes.omega[elastic] ** 2
    noise = rounding * float(np.linalg.norm(compliance, axis=0).max(initial=0.0))
    return np.asarray(np.maximum(np.linalg.norm(compliance.T @ load, axis=0), noise))


def _dropped(pace: Pace, gone: BoolArray) -> Pace:
    """The pace without the factors of some cases."""
    keep = [i for i, case in enumerate(pace.anchored) if not gone[case]]
    return replace(
        pace,
        anchored=pace.anchored[keep],
        anchor_u=pace.anchor_u[:, keep],
        anchor_slip=pace.anchor_slip[:, :, keep],
    )


def _anchored(pace: Pace, slow: BoolArray, u: FloatArray, slip: FloatArray) -> Pace:
    """The pace with a factor of their own for the slow cases, at u and the slip history of the step just done."""
    cases, kept = np.flatnonzero(slow), _dropped(pace, slow)
    return replace(
        kept,
        waited=np.where(slow, 0, pace.waited),
        anchored=np.concatenate([kept.anchored, cases]).astype(np.int64),
        anchor_u=np.concatenate([kept.anchor_u, u[:, cases]], axis=1),
        anchor_slip=np.concatenate([kept.anchor_slip, slip[:, :, cases]], axis=2),
    )


def rescaled(old: MotionState, dynamics: Dynamics, scheme: Scheme, interval: float, level: int) -> MotionState:
    """The state made ready for a step of another size: its a moved to the time that the new size gives it.

    a_n stands for u'' at t_n + (am - af) h. Without this shift every change of h errs by O(h) in the acceleration
    (Bruels & Arnold, J. Comput. Nonlinear Dyn. 3 (2008) 031007). The displacements before are dropped: they lie at
    other distances than the extrapolation takes them to.
    """
    if level == old.pace.last_level:
        return old
    change = interval * (2.0**-level - 2.0**-old.pace.last_level)
    a = old.a + (scheme.alpha_m - scheme.alpha_f) * change * old.pace.jerk
    inertia_a, damping_a = dynamics.mass_and_damping(a)
    return replace(old, a=a, inertia_a=inertia_a, damping_a=damping_a, history=old.history[:1])


def too_small(old: MotionState, error: float, step: float) -> FemConvergenceError:
    """The error of an adaptive march that would need steps below the finest."""
    return FemConvergenceError(
        "local error is above its tolerance at the smallest step",
        where=f"step {old.step + 1}",
        value=f"{error:.2e} times the tolerance at {step:.2e} s",
        advice="allow more halvings (max_cutbacks), a larger error tolerance or a smaller output interval",
    )
