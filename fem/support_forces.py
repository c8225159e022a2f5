"""What supports and springs carry in motion, output by output."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray
from fem.model import Model
from fem.motion import MotionState, StepRecord
from fem.supports import components


class SupportForces:
    """Forces with which the supports hold a structure, at the held degrees of freedom alone.

        R = M u'' + C u' + f_viscous + f - p

    ``share`` (3 n_support, n_held) sums them up by support; a component that two supports hold counts for the first of
    them, so that the resultants of all supports add up to the whole.
    """

    def __init__(self, model: Model) -> None:
        self._held = np.flatnonzero(~model.free)
        self._mass = sp.csr_matrix(model.mass[self._held])
        owner = np.full((len(model.points), 3), -1)
        for number, support in reversed(list(enumerate(model.supports))):
            nodes, axes = components(model.bodies, model.offsets, support)
            for axis in axes:
                owner[nodes, axis] = number
        # A model whose ``free`` was replaced by hand holds more than its supports do.
        columns = np.flatnonzero(owner.ravel()[self._held] >= 0)
        rows = 3 * owner.ravel()[self._held[columns]] + self._held[columns] % 3
        entries = (np.ones(len(rows)), (rows, columns))
        self.share = sp.csr_matrix(entries, shape=(3 * len(model.supports), len(self._held)))

    def __call__(self, state: MotionState, acceleration: FloatArray, load: FloatArray) -> FloatArray:
        """R (n_held, n_case) N in a state, with u'' (n_dof, n_case) m/s^2 and p (n_dof, n_case) N at its time."""
        others = state.force[self._held] + state.viscous[self._held] + state.damping_v[self._held] - load[self._held]
        return np.asarray(self._mass @ acceleration + others)

    def resultants(self, record: StepRecord) -> FloatArray:
        """Resultant of every support at an output, (n_support, 3, n_case) N."""
        forces = record.support_force
        return np.asarray(self.share @ forces).reshape(-1, 3, forces.shape[1])


class SpringForces:
    """Forces -k (u + beta u') with which springs and foundations act, their share in Rayleigh damping included."""

    def __init__(self, model: Model, beta: float) -> None:
        self._rows, self._beta = model.springs.resultants(), beta

    def resultants(self, record: StepRecord) -> FloatArray:
        """Resultant of every spring at an output, (n_spring, 3, n_case) N."""
        state = record.state
        pull = self._rows @ state.u + self._beta * (self._rows @ state.v)
        return np.asarray(pull).reshape(-1, 3, state.u.shape[1])
