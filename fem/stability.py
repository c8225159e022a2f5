"""Whether an equilibrium is stable: the signs of the pivots of its tangent."""

from __future__ import annotations

import importlib

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fem.errors import FemConvergenceError
from fem.linear_solver import available_solvers
from fem.model import Model
from fem.preload import StaticState
from fem.rigid_motion import check_closed, check_restraint


def unstable_directions(model: Model, state: StaticState) -> int:
    """Number of independent directions in which an equilibrium gives way under its loads: 0 where it is stable.

    K = L D L' has as many negative pivots as negative eigenvalues (Sylvester). Newton finds unstable equilibria as
    well as stable ones, such as the straight state of a column above its critical load, and says nothing. Closed points
    count as stuck; costs one factorisation.

    Raises
    ------
    FemInputError : a part that nothing holds in this state. FemConvergenceError : a tangent that is singular.
    """
    state.check_belongs(model)
    check_restraint(model)
    check_closed(model, state.contact.status[:, 0], "stability")
    elastic = model.following(state.follower).elastic_tangent(state.u)
    # The part of follower pressures that has no potential is left out: it may make a state flutter, not buckle.
    tangent = 0.5 * (elastic + elastic.T) + model.contact.stick_tangent(state.contact.status[:, 0])
    return negative_pivots(model.constrain(tangent))


def negative_pivots(matrix: sp.csr_matrix) -> int:
    """Number of negative eigenvalues of a symmetric matrix, by MKL PARDISO or else by SuperLU without row exchanges."""
    if "pardiso" in available_solvers():
        direct = importlib.import_module("fem.pardiso").Pardiso(symmetric=True, definite=False)
        direct.analyse(matrix)
        direct.factor(matrix)
        return int(direct.negative)
    return _by_superlu(matrix)


def _by_superlu(matrix: sp.csr_matrix) -> int:
    options = {"SymmetricMode": True}
    advice = "the state lies at a limit or bifurcation point: move it a little"
    try:
        lu = spla.splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise FemConvergenceError("the tangent is singular", where="stability", advice=advice) from error
    if not np.array_equal(lu.perm_r, lu.perm_c):
        raise FemConvergenceError("the tangent has a pivot of zero", where="stability", advice=advice)
    return int((lu.U.diagonal() < 0.0).sum())
