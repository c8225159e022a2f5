"""Undamped modes about an equilibrium with stuck contact, and Rayleigh damping from two ratios."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fem.arrays import FloatArray
from fem.bounds import require, require_count
from fem.errors import FemConvergenceError, FemInputError
from fem.finite_values import finite_array
from fem.linear_solver import make_solver
from fem.model import Model
from fem.preload import StaticState
from fem.rigid_motion import check_closed, check_restraint

_RIGID = 1e-6
"""Eigenvalues above minus this share of the shift are those of rigid motions: roundoff of a stiffness that is zero."""

_TOUCHING = 1e-13
"""Gap over the largest coordinate that counts as none: a few hundred units of rounding."""


@dataclass(frozen=True)
class ModalBasis:
    """Modes K phi = omega^2 M phi, Phi' M Phi = I, largest component positive.

    Attributes
    ----------
    omega : (n_mode,) rad/s.
    shapes : (n_dof, n_mode) kg^-0.5.
    left : (n_dof, n_mode) M Phi.
    stiffness : tangent of the bodies at the equilibrium without contact, N/m.
    material : the same without stress stiffening: Rayleigh damping is C = alpha M + beta material there.
    """

    omega: FloatArray
    shapes: FloatArray
    left: FloatArray
    stiffness: sp.csr_matrix
    material: sp.csr_matrix


@dataclass(frozen=True)
class Rayleigh:
    """Forces alpha M v and stresses S_v = beta C:E' in the bodies; contact adds no viscous damping.

    E' is the rate of the Green-Lagrange strain: a constant C = alpha M + beta K of the rest state would see strain in
    every rotation and damp a thin panel far too much at large amplitude. At the equilibrium both agree.
    """

    alpha: float
    beta: float


def rest_state(model: Model) -> StaticState:
    """The undeformed, unloaded structure as an equilibrium to linearise about; free bodies have no other.

    Contact is open here where surfaces just touch, and closed where they overlap: what only contact holds is loose.
    """
    u, contact = np.zeros((model.n_dof, 1)), model.contact
    found = contact.evaluate(contact.relative(u), contact.no_slip(1))
    # Of surfaces that just touch, rounding would leave some points closed and others open.
    touching = np.abs(contact.initial_gap) <= _TOUCHING * np.abs(model.points).max()
    status = np.where(touching[:, None], 0, found.status)
    traction = np.where(np.repeat(touching, 3)[:, None], 0.0, found.traction)
    return StaticState(u[:, 0], replace(found, status=status, traction=traction), (), ())


def solve_modes(
    model: Model, state: StaticState, count: int, *, solver: str = "auto", shift_hz: float = 0.0
) -> ModalBasis:
    """The lowest ``count`` modes by shift-invert Lanczos at -(2 pi shift_hz)^2.

    Closed points are stuck (k_n, k_t), open points carry nothing. The shift at 0 needs stiffness: a body that nothing
    holds raises ``FemInputError``, an unstable equilibrium ``FemConvergenceError``. With a positive shift, of the order
    of the lowest elastic frequency, free bodies are allowed: their rigid modes come out with omega = 0 within roundoff.
    Of the load stiffness of follower pressures the symmetric part is taken: all of it where they have a potential.
    """
    state.check_belongs(model)
    require_count("modes", "count", count, 1, most=int(model.free.sum()) - 1)
    require("modes", "shift_hz", shift_hz, 0.0)
    if shift_hz == 0.0:
        check_restraint(model)
        check_closed(model, state.contact.status[:, 0], "modes")
    elastic = model.following(state.follower).elastic_tangent(state.u)
    if model.followers.any:
        elastic = (0.5 * (elastic + elastic.T)).tocsr()
    tangent = model.constrain(elastic + model.contact.stick_tangent(state.contact.status[:, 0]))
    keep = sp.diags(model.free.astype(float))
    mass = (keep @ model.mass @ keep).tocsr()
    sigma = -((2.0 * np.pi * shift_hz) ** 2)
    shifted = tangent if sigma == 0.0 else (tangent - sigma * mass).tocsr()
    direct = make_solver(solver, symmetric=True)
    direct.analyse(shifted)
    try:
        direct.factor(shifted)
    except FemConvergenceError as error:
        raise _unstable(str(error)) from error
    operator = spla.LinearOperator(tangent.shape, matvec=direct.solve, dtype=np.float64)
    # Supported rows have stiffness 1 and mass 0: infinite eigenvalues, which shift-invert never meets.
    start = np.where(model.free, np.sin(1.0 + np.arange(model.n_dof)), 0.0)
    values, shapes = spla.eigsh(tangent, count, mass, sigma=sigma, OPinv=operator, v0=start)
    if np.any(values <= -_RIGID * abs(sigma)):
        raise _unstable(f"omega^2 = {values.min():.4g} 1/s^2")
    values = np.maximum(values, 0.0)
    order = np.argsort(values)
    shapes = shapes[:, order]
    shapes /= np.sqrt(np.einsum("nm,nm->m", shapes, mass @ shapes))
    shapes *= _signs(shapes)
    material = model.elastic_tangent(state.u, geometric=False)
    omega = np.sqrt(values[order])
    return ModalBasis(omega, np.ascontiguousarray(shapes), np.asarray(mass @ shapes), elastic, material)


def _unstable(value: str) -> FemConvergenceError:
    what = "the tangent is not positive definite"
    advice = "this equilibrium is unstable, buckled or past a limit point: see unstable_directions, check the preload"
    return FemConvergenceError(what, where="modes", value=value, advice=advice)


def no_modes(model: Model, state: StaticState) -> ModalBasis:
    """A basis of no modes, for transients that correct no dispersion; bodies need not be held."""
    empty = np.zeros((model.n_dof, 0))
    tangents = (model.elastic_tangent(state.u), model.elastic_tangent(state.u, geometric=False))
    return ModalBasis(np.zeros(0), empty, empty, *tangents)


def rayleigh(modes: ModalBasis, which: tuple[int, int], ratios: tuple[float, float]) -> Rayleigh:
    """alpha and beta that give two modes (numbered from 0) their damping ratios.

    2 zeta_j omega_j = alpha + beta kappa_j with kappa_j = phi_j' K phi_j and K the material tangent: omega_j^2 less
    the shares of contact and stress stiffening.
    """
    chosen = [int(mode) for mode in finite_array(which, (2,), "the pair of modes", where="damping")]
    if min(chosen) < 0 or max(chosen) >= len(modes.omega):
        raise FemInputError(
            "no such mode", where="damping", value=which, advice=f"modes are 0 to {len(modes.omega) - 1}"
        )
    kappa = modal_stiffness(modes)[chosen]
    if kappa[0] == kappa[1]:
        raise FemInputError("two different modes are needed", where="damping", value=which)
    right = 2.0 * finite_array(ratios, (2,), "the pair of ratios", where="damping") * modes.omega[chosen]
    alpha, beta = np.linalg.solve(np.column_stack([np.ones(2), kappa]), right)
    if alpha < 0.0 or beta < 0.0:
        advice = "choose ratios that C = alpha M + beta K can reach with positive coefficients"
        raise FemInputError(
            "negative Rayleigh coefficient", where="damping", value=(float(alpha), float(beta)), advice=advice
        )
    return Rayleigh(float(alpha), float(beta))


def modal_stiffness(modes: ModalBasis) -> FloatArray:
    """kappa_j = phi_j' K phi_j of the bodies, (n_mode,) 1/s^2."""
    return np.asarray(np.einsum("nm,nm->m", modes.shapes, modes.material @ modes.shapes))


def damping_ratios(modes: ModalBasis, damping: Rayleigh) -> FloatArray:
    """zeta_j = (alpha + beta kappa_j) / (2 omega_j)."""
    return np.asarray((damping.alpha + damping.beta * modal_stiffness(modes)) / (2.0 * modes.omega))


def _signs(shapes: FloatArray) -> FloatArray:
    """Signs (n_mode,) that make the first of the largest entries of each shape positive.

    Symmetric shapes have equal entries of both signs: within a thousandth they count as equal, or rounding would
    choose, and with it the direction of a start along the shape.
    """
    magnitude = np.abs(shapes)
    first = np.argmax(magnitude >= 0.999 * magnitude.max(axis=0), axis=0)
    return np.asarray(np.sign(shapes[first, np.arange(shapes.shape[1])]))
