"""Static states that hold wanted modal coordinates: the starts of snap-back ring-downs."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fem.arrays import FloatArray
from fem.bounds import require_count
from fem.errors import FemConvergenceError
from fem.model import Model
from fem.modes import ModalBasis
from fem.preload import Progress, StaticState
from fem.roundoff import is_rounding
from fem.tangent_solver import TangentSolver


def hold_modes(
    model: Model,
    equilibrium: StaticState,
    modes: ModalBasis,
    eta: FloatArray,
    *,
    steps: int = 8,
    tolerance: float = 1e-6,
    max_iterations: int = 40,
    solver: str = "auto",
    progress: Progress | None = None,
) -> StaticState:
    """The static state with Phi' M (u - u_s) = eta under the modal load M Phi c that holds it there.

    f_int(u) + f_contact(u, slip) = p + M Phi c;  unknowns u and c; Newton with these side conditions
    (``TangentSolver``). Everything but the held modes has settled, so that a release from here starts close to the slow
    manifold; friction keeps the history of the way.

    Parameters
    ----------
    eta : (n_held,) m kg^0.5, coordinates of the first modes.
    tolerance : residual relative to the linear modal force omega^2 M phi eta, or what rounding leaves of it.
    max_iterations : of Newton, per step.
    """
    require_count("held modes", "steps", steps, 1)
    require_count("held modes", "max_iterations", max_iterations, 1)
    hold = _Hold(model, equilibrium, modes, (eta, steps), (tolerance, max_iterations, solver))
    for step in range(1, steps + 1):
        hold.advance(step)
        if progress is not None:
            progress(step / steps)
    return StaticState(hold.u, hold.state, tuple(np.arange(1, steps + 1) / steps), tuple(hold.history))


class _Hold:
    """The way to the wanted coordinates in equal steps."""

    def __init__(
        self,
        model: Model,
        equilibrium: StaticState,
        modes: ModalBasis,
        way: tuple[FloatArray, int],
        effort: tuple[float, int, str],
    ) -> None:
        self.model, self.rest = model, equilibrium
        self.eta, self.steps = way
        self.tolerance, self.max_iterations, self.solver = effort
        count = len(self.eta)
        self.left, self.shapes = modes.left[:, :count] * model.free[:, None], modes.shapes[:, :count]
        self.stiffness = modes.omega[:count] ** 2
        self.scale = float(np.linalg.norm(self.left @ (self.stiffness * self.eta)))
        self.u, self.slip, self.c = equilibrium.u, equilibrium.contact.slip, np.zeros(count)
        self.state = equilibrium.contact
        self.history: list[float] = []
        self.newton = TangentSolver(self.left, self.solver)

    def advance(self, step: int) -> None:
        """From the state before to ``step`` of all steps, by Newton with the consistent tangent."""
        self.u = self.u + self.shapes @ (self.eta / self.steps)
        self.c = self.c + self.stiffness * self.eta / self.steps
        last = float("inf")
        for _ in range(self.max_iterations):
            residual, miss = self._residual(step)
            size = self.history[-1] * self.scale
            sizes = size, last, self.scale
            if self.history[-1] <= self.tolerance or is_rounding(self.model, self.u, self.slip, sizes):
                self.slip = self.state.slip
                return
            last = size
            moved, loaded = self.newton.solve(self._tangent(symmetric=False), self._symmetric, residual, miss)
            self.u, self.c = self.u + moved, self.c + loaded
        raise FemConvergenceError(
            "no static state at the wanted modal coordinates",
            where="start of a ring-down",
            value=f"relative residual {self.history[-1]:.2e} at {step}/{self.steps}",
            advice="use a smaller amplitude or more steps",
            history=tuple(self.history),
        )

    def _tangent(self, *, symmetric: bool) -> sp.csr_matrix:
        contact = self.model.contact.tangent(self.u, self.slip[:, :, 0], symmetric=symmetric)
        return self.model.constrain(self.model.elastic_tangent(self.u) + contact)

    def _symmetric(self) -> sp.csr_matrix:
        return self._tangent(symmetric=True)

    def _residual(self, step: int) -> tuple[FloatArray, FloatArray]:
        """What is out of balance (n_dof,) N, and what the coordinates miss (n_held,); keeps the contact state."""
        model = self.model
        self.state = model.contact.evaluate(model.contact.relative(self.u[:, None]), self.slip)
        force = model.elastic_force(self.u[:, None])[0] + model.contact.force(self.state.traction)
        residual = np.where(model.free, model.load + self.left @ self.c - force[:, 0], 0.0)
        self.history.append(float(np.linalg.norm(residual)) / self.scale)
        return residual, step / self.steps * self.eta - self.left.T @ (self.u - self.rest.u)
