"""Joints between bodies by name: frictional pairs and ties, their penalties, their operators."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import scipy.sparse as sp

from fem.arrays import FloatArray, IntArray
from fem.body import Body, locate
from fem.bounds import require
from fem.contact import Contact, ContactLaw
from fem.contact_pair import contact_pair
from fem.errors import FemInputError
from fem.pairing import mean_size
from fem.reach import TieWarning

MISSED, LITTLE = 0.1, 1.0 / 3.0
"""A tie may hold less than was meant where more than MISSED of its smaller surface faces the other one out of reach, or
less than LITTLE finds a partner. Lap joints tie halves of faces, washers faces over holes."""


@dataclass(frozen=True)
class Pair:
    """A frictional interface between two surfaces named "<body>.<surface>".

    Attributes
    ----------
    friction : Coulomb coefficient.
    normal_penalty, tangential_penalty : Pa/m; default ``stiffness`` times ``default_penalty`` of the slave.
    stiffness : penalties in multiples of E / h. 1 adds the compliance of a layer of one facet size; 10 a tenth of it.
    reach : largest initial distance in m at which two points are paired, before the master and behind it. Default
        before it a twentieth of the diagonal of the smaller surface (at least as behind it), so that refining a curved
        contact does not cut it; behind it, for interference, half the mean slave facet size. ``ReachWarning`` says
        where points beyond it came through.
    """

    name: str
    slave: str
    master: str
    friction: float
    normal_penalty: float | None = None
    tangential_penalty: float | None = None
    stiffness: float = 1.0
    reach: float | None = None


@dataclass(frozen=True)
class Tie:
    """Two surfaces "<body>.<surface>" bonded for good, their meshes need not match.

    The bond is elastic, tau = k (u_s - u_m) in all directions and in tension too, so that it adds to the stiffness and
    no constraint enters a solver. k = ``stiffness`` E / h unless ``penalty`` (Pa/m) is given: at the default of 100 the
    bond is as compliant as a hundredth of a facet size of material. A distance between the surfaces is kept.
    ``reach`` in m is the largest one, by default half the mean slave facet size; ``TieWarning`` says where more than
    a tenth of the smaller surface faces the other one farther away, or less than a third finds a partner.
    """

    name: str
    slave: str
    master: str
    penalty: float | None = None
    stiffness: float = 100.0
    reach: float | None = None


def default_penalty(body: Body, facets: IntArray) -> float:
    """k = E / h with the mean facet size h: the interface is as stiff as a layer of one facet size, Pa/m.

    Its error is an extra compliance: penetration p / k, and elastic slip tau / k before real slip.
    """
    return body.material.young_modulus / mean_size(body.mesh.points, facets)


def pair_contact(bodies: Sequence[Body], offsets: IntArray, points: FloatArray, pair: Pair) -> Contact:
    """The contact points of a pair; unknown names and surfaces that do not meet raise ``FemInputError``."""
    where = f"joint {pair.name}"
    require(where, "friction", pair.friction, 0.0)
    for name in ("normal_penalty", "tangential_penalty"):
        if getattr(pair, name) is not None:
            require(where, name, getattr(pair, name), 0.0, above=True)
    default = _penalty(bodies, pair)
    law = ContactLaw(
        default if pair.normal_penalty is None else pair.normal_penalty,
        default if pair.tangential_penalty is None else pair.tangential_penalty,
        pair.friction,
    )
    return _joined(bodies, offsets, points, pair, law)


def tie_bond(bodies: Sequence[Body], offsets: IntArray, points: FloatArray, tie: Tie) -> Contact:
    """The points of a tie with its penalty in both directions; friction plays no part."""
    if tie.penalty is not None:
        require(f"joint {tie.name}", "penalty", tie.penalty, 0.0, above=True)
    penalty = _penalty(bodies, tie) if tie.penalty is None else tie.penalty
    bond = _joined(bodies, offsets, points, tie, ContactLaw(penalty, penalty, 0.0))
    _check_bonded(tie, bond)
    return bond


def _check_bonded(tie: Tie, bond: Contact) -> None:
    """Warn of a tie that holds little of both surfaces, or leaves much of what faces each other out of reach."""
    area, (slave, master) = float(bond.area.sum()), bond.surface[0]
    smaller = min(slave, master)
    missed = float(bond.left_out.area[bond.left_out.gap > 0.0].sum())
    if area >= LITTLE * smaller and min(missed, smaller - area) <= MISSED * smaller:
        return
    beyond = missed / slave
    far = f"{100.0 * beyond:.3g} % of the slave faces it farther than the reach of {bond.left_out.reach[0]:.3g} m"
    warnings.warn(
        f"tie {tie.name}: only {100.0 * area / slave:.3g} % of the slave {tie.slave} ({100.0 * area / master:.3g} % of "
        f"the area of {tie.master}) finds a partner and is bonded; "
        + (f"{far}: enlarge it where the gap is to be bonded" if beyond > 0.0 else "the rest faces nothing near")
        + "; tie regions that cover each other if this is meant",
        TieWarning,
        stacklevel=5,
    )


def bond_stiffness(bond: Contact) -> sp.csr_matrix:
    """B' w k B of points that never open or slip, (n_dof, n_dof) N/m."""
    blocks = sp.diags((bond.area[:, None] * bond.law[:, [0, 1, 1]]).ravel())
    return (bond.operator.T @ blocks @ bond.operator).tocsr()


def _penalty(bodies: Sequence[Body], joint: Pair | Tie) -> float:
    if not 0.0 < joint.stiffness < math.inf:
        raise FemInputError("stiffness must be positive and finite", where=f"joint {joint.name}", value=joint.stiffness)
    if joint.reach is not None:
        require(f"joint {joint.name}", "reach", joint.reach, 0.0, above=True)
    index, slave = locate(bodies, joint.slave, where=f"joint {joint.name}", surface=True)
    return joint.stiffness * default_penalty(bodies[index], bodies[index].mesh.surface(slave))


def _joined(
    bodies: Sequence[Body], offsets: IntArray, points: FloatArray, joint: Pair | Tie, law: ContactLaw
) -> Contact:
    where = f"joint {joint.name}"
    s, slave = locate(bodies, joint.slave, where=where, surface=True)
    m, master = locate(bodies, joint.master, where=where, surface=True)
    return contact_pair(
        joint.name,
        points,
        (bodies[s].mesh.surface(slave) + offsets[s], bodies[m].mesh.surface(master) + offsets[m]),
        law,
        reach=joint.reach,
        bonded=isinstance(joint, Tie),
    )
