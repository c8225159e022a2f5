"""Static states that hold chosen modal coordinates: the start of a snap-back ring-down."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.errors import FemConvergenceError
from fem.linear_solver import make_solver
from fem.model import Model
from fem.modes import ModalBasis
from fem.preload import Progress, StaticState


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

    f_int(u) + f_contact(u, slip) = p + M Phi c;  unknowns u and c; Newton with bordered elimination. Everything but the
    held modes has settled, so that a release from here starts close to the slow manifold; friction keeps the history of
    the way.

    Parameters
    ----------
    eta : (n_held,) m kg^0.5, coordinates of the first modes.
    tolerance : residual relative to the linear modal force omega^2 M phi eta.
    """
    left = modes.left[:, : len(eta)] * model.free[:, None]
    scale = float(np.linalg.norm(left @ (modes.omega[: len(eta)] ** 2 * eta)))
    u, slip = equilibrium.u, equilibrium.contact.slip
    c = np.zeros(len(eta))
    history: list[float] = []
    for step in range(1, steps + 1):
        target = step / steps * eta
        u = u + modes.shapes[:, : len(eta)] @ (eta / steps)
        c = c + modes.omega[: len(eta)] ** 2 * eta / steps
        for _ in range(max_iterations):
            state = model.contact.evaluate(model.contact.relative(u[:, None]), slip)
            force = model.elastic_force(u[:, None])[0] + model.contact.force(state.traction)
            residual = np.where(model.free, model.load + left @ c - force[:, 0], 0.0)
            miss = target - left.T @ (u - equilibrium.u)
            history.append(float(np.linalg.norm(residual)) / scale)
            if history[-1] <= tolerance:
                break
            tangent = model.constrain(model.elastic_tangent(u) + model.contact.tangent(u, slip[:, :, 0]))
            direct = make_solver(solver, symmetric=False)
            direct.analyse(tangent)
            direct.factor(tangent)
            solution = direct.solve(np.column_stack([residual, left]))
            change = np.linalg.solve(left.T @ solution[:, 1:], miss - left.T @ solution[:, 0])
            u, c = u + solution[:, 0] + solution[:, 1:] @ change, c + change
        else:
            raise FemConvergenceError(
                "no static state at the wanted modal coordinates",
                where="start of a ring-down",
                value=f"relative residual {history[-1]:.2e} at {step}/{steps}",
                advice="use a smaller amplitude or more steps",
                history=tuple(history),
            )
        slip = state.slip
        if progress is not None:
            progress(step / steps)
    return StaticState(u, state, tuple(np.arange(1, steps + 1) / steps), tuple(history))
