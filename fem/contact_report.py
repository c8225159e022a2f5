"""What the penalties of an interface cost: penetration and elastic slip, against what they should be small to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.model import Model
from fem.preload import StaticState


@dataclass(frozen=True)
class PenaltyReport:
    """One contact pair at one state.

    Attributes
    ----------
    penetration : largest p / k_n, m; penetration_in_facets : the same over the facet size there.
    compliance_share : elastic energy of the penalties over the strain energy of the bodies: the share of the stiffness
        that they take from the structure.
    elastic_slip : largest tau / k_t of a point, m; real_slip : largest path end s_p of a closed point, m. Where the
        first is not small to the second, stick is softer than the surfaces are.
    """

    name: str
    penetration: float
    penetration_in_facets: float
    compliance_share: float
    elastic_slip: float
    real_slip: float


def penalty_reports(model: Model, state: StaticState) -> tuple[PenaltyReport, ...]:
    """The report of every pair; zero strain energy gives nan shares."""
    contact = model.contact
    traction = state.contact.traction[:, 0].reshape(-1, 3)
    elastic = traction / contact.law[:, [0, 1, 1]]
    energy = 0.5 * contact.area * np.einsum("gi,gi->g", traction, elastic)
    strain = float(model.elastic_force(state.u[:, None])[1][0])
    closed = state.contact.status[:, 0] > 0
    slip = np.where(closed, np.linalg.norm(state.contact.slip[:, :, 0], axis=1), 0.0)
    depth, stretch = -elastic[:, 0], np.linalg.norm(elastic[:, 1:], axis=1)
    reports = []
    for number, name in enumerate(contact.names):
        at = contact.pair == number
        reports.append(
            PenaltyReport(
                name,
                float(depth[at].max()),
                float((depth[at] / contact.facet_size[at]).max()),
                float(energy[at].sum()) / strain if strain > 0.0 else float("nan"),
                float(stretch[at].max()),
                float(slip[at].max()),
            )
        )
    return tuple(reports)
