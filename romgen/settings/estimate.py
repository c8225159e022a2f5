"""Memory and run time of a study before it is computed, from the mesh size alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from romgen.settings.finite_elements import BlockSettings
from romgen.settings.study import Study

# The panel of the quick start on a fine mesh (python -m benchmarks.sizes), 2 threads: a step of one bending ring-down
# from 2 mm; five ring-downs of all mixes together take about as long as five alone, since the others iterate more.
REFERENCE_DOFS = 186_213
REFERENCE_FACTOR_ENTRIES = 148e6
REFERENCE_STEP_S = 0.34
BATCH_SHARE = 0.9
# Fill and solve work of nested dissection grow as n^(4/3) in three dimensions (George 1973).
FILL_EXPONENT = 4.0 / 3.0
# Interpreter, compiled kernels and libraries before any model is built.
BASE_MEMORY_BYTES = 350e6


@dataclass(frozen=True)
class Estimate:
    """Size of the finite-element model and what it will cost, within a factor of about three.

    Attributes
    ----------
    dofs : displacement unknowns before constraints.
    memory_bytes : peak memory of the ring-down stage.
    wall_s : wall time of all ring-downs, s.
    """

    dofs: int
    memory_bytes: float
    wall_s: float


def block_nodes(block: BlockSettings) -> int:
    """Number of nodes of a structured block: corners and edges, with HEX27 and TET10 also face and cell centres."""
    n = np.array([sum(block.axis(axis)[1]) for axis in ("x", "y", "z")])
    if block.element != "hex20":
        return int(np.prod(2 * n + 1))
    corners = int(np.prod(n + 1))
    edges = sum(int(n[k] * np.prod(np.delete(n, k) + 1)) for k in range(3))
    return corners + edges


def estimate(study: Study, mesh_nodes: int = 0) -> Estimate | None:
    """Estimate size, memory and run time of the ring-downs; None for a study from data.

    Scaled from the measured reference with n^(4/3) for fill and solves; snapshots are kept in single precision.

    Parameters
    ----------
    mesh_nodes : number of nodes of the bodies that come from files.
    """
    if study.ringdowns is None:
        return None
    dofs = 3 * (mesh_nodes + sum(block_nodes(block) for block in study.blocks.values()))
    growth = (dofs / REFERENCE_DOFS) ** FILL_EXPONENT
    starts, steps = len(study.ringdowns.starts), study.ringdowns.steps
    snapshots = 4 * dofs * starts * (steps // study.ringdowns.snapshot_stride + 1)
    factor = 8 * REFERENCE_FACTOR_ENTRIES * growth
    wall = steps * REFERENCE_STEP_S * growth * max(1.0, BATCH_SHARE * starts)
    return Estimate(dofs=dofs, memory_bytes=BASE_MEMORY_BYTES + factor + 2 * snapshots, wall_s=wall)
