"""What a transient showed over time: sensors, energies with their balance, resultants and status of the interfaces."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from fem.arrays import FloatArray
from fem.bounds import require_count
from fem.central_difference import ExplicitTransient
from fem.errors import FemError
from fem.finite_values import check_rows
from fem.motion import MotionState, StepRecord
from fem.reach import no_depth, warn_of_reach
from fem.sliding import sliding_motion, warn_of_sliding
from fem.transient import Transient

OPEN = 0.1
"""Share of the energy that went through a march which its ledger may miss without a warning."""

ROUNDING = 1e-10
"""Share of the energy stored at rest whose appearance or loss counts as rounding."""


class EnergyWarning(UserWarning):
    """A march made or lost energy that nothing accounts for."""


@dataclass(frozen=True)
class History:
    """One march, from its first state on.

    Attributes
    ----------
    t : (n_time,) s.
    displacement, velocity, acceleration : (n_time, n_sensor, n_case) m from the equilibrium, m/s, m/s^2; the
        acceleration of generalised-alpha lags by (alpha_m - alpha_f) h.
    kinetic, strain, contact : (n_time, n_case) J, relative to the equilibrium.
    friction, damping, external : (n_time, n_case) J, work since the first state; external that of loads and supports.
    force : (n_time, n_pair, 3, n_case) N, resultant of the tractions of every pair on its master.
    reaction : (n_time, n_support, 3, n_case) N, resultant of every support of the model, the static part included; what
        two supports hold counts for the first of them. With loads it balances M u'' + alpha M u': exactly for central
        differences, to O(h^2) for generalised-alpha.
    spring : (n_time, n_spring, 3, n_case) N, force of every spring and foundation, its damping beta k u' included.
    closed, slipping : (n_time, n_pair, n_case) m^2, area in contact and the part of it that slips.
    state : to march on from.
    """

    t: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    kinetic: FloatArray
    strain: FloatArray
    contact: FloatArray
    friction: FloatArray
    damping: FloatArray
    external: FloatArray
    force: FloatArray
    reaction: FloatArray
    spring: FloatArray
    closed: FloatArray
    slipping: FloatArray
    state: MotionState

    @property
    def imbalance(self) -> FloatArray:
        """Change of the stored energy plus friction and damping less external work, (n_time, n_case) J."""
        stored = self.kinetic + self.strain + self.contact
        return np.asarray(stored - stored[0] + self.friction + self.damping - self.external)


Marching = Transient | ExplicitTransient


def record_history(transient: Marching, state: MotionState, n_step: int, sensors: FloatArray) -> History:
    """March ``n_step`` outputs from a state and keep what they show.

    Parameters
    ----------
    sensors : (n_sensor, n_dof) rows of ``sensor_rows``.

    Issues ``SlidingWarning``, ``ReachWarning`` and ``EnergyWarning``. Raises as the march does; the history up to
    there is in ``last_good`` of the error.
    """
    require_count("history", "n_step", n_step, 0)
    check_rows(sensors, transient.model.n_dof, where="history")
    contact = transient.model.contact
    last = transient.observe(state)
    rows, slid, depth = [_row(last, transient, sensors)], np.zeros(contact.n_point), no_depth(contact.left_out)
    try:
        for record in transient.march(state, n_step):
            rows.append(_row(record, transient, sensors))
            slid = np.maximum(slid, sliding_motion(contact, contact.relative(record.state.u), record.contact.status))
            depth = np.maximum(depth, contact.left_out.depth(record.state.u))
            last = record
    except FemError as error:
        error.last_good = _history(rows, state, last, transient.settings.time_step)
        raise
    history = _history(rows, state, last, transient.settings.time_step)
    warn_of_sliding(contact, slid)
    warn_of_reach(contact.names, contact.left_out, depth)
    warn_of_imbalance(history, ROUNDING * float(transient.rest_energies.sum()))
    return history


def _history(rows: list[tuple[FloatArray, ...]], first: MotionState, last: StepRecord, step: float) -> History:
    columns = [np.stack(column) for column in zip(*rows, strict=True)]
    motion, energies, done, force, reaction, spring, areas = columns
    done = done - first.work
    return History(
        t=np.asarray((first.step + np.arange(len(rows))) * step),
        displacement=motion[:, 0],
        velocity=motion[:, 1],
        acceleration=motion[:, 2],
        kinetic=energies[:, 0],
        strain=energies[:, 1],
        contact=energies[:, 2],
        friction=done[:, 0],
        damping=done[:, 1],
        external=done[:, 2],
        force=force,
        reaction=reaction,
        spring=spring,
        closed=areas[:, 0],
        slipping=areas[:, 1],
        state=last.resume,
    )


def warn_of_imbalance(history: History, rounding: float = 0.0) -> None:
    """Issue ``EnergyWarning`` where the ledger is open by more than OPEN of the energy that went through the march.

    Nothing below ``rounding`` J is said: a loaded structure that stays at rest has no other energies.
    """
    stored = history.kinetic + history.strain + history.contact
    spent = history.friction + history.damping
    through = np.abs(np.stack([history.kinetic, stored - stored.min(axis=0), spent, history.external])).max(axis=(0, 1))
    miss = np.abs(history.imbalance)
    for case in np.flatnonzero(miss.max(axis=0) > np.maximum(OPEN * through, rounding)):
        first = int(np.argmax(miss[:, case] > OPEN * through[case]))
        warnings.warn(
            f"case {case}: the energies of the march do not add up by {miss[:, case].max():.3g} J of "
            f"{through[case]:.3g} J, from t = {history.t[first]:.4g} s on; use a smaller time step or spectral radius "
            "(contact that opens and closes within a few steps makes energy)",
            EnergyWarning,
            stacklevel=3,
        )


def _row(record: StepRecord, transient: Marching, sensors: FloatArray) -> tuple[FloatArray, ...]:
    state, contact = record.state, transient.model.contact
    moved = state.u - transient.equilibrium.u[:, None]
    traction = record.contact.traction.reshape(contact.n_point, 3, state.u.shape[1])
    member = (contact.pair == np.arange(len(contact.names))[:, None]) * contact.area
    status = record.contact.status
    return (
        np.stack([sensors @ moved, sensors @ state.v, sensors @ state.a]),
        record.energies - transient.rest_energies,
        state.work,
        np.einsum("pg,gij,gic->pjc", member, contact.frame, traction),
        transient.dynamics.support_force.resultants(record),
        transient.dynamics.spring_force.resultants(record),
        np.stack([member @ (status > 0), member @ (status == 2)]),
    )
