"""VTU and PVD files of a study: preload displacement, mode shapes, snapshots of a ring-down."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from romgen.arrays import FloatArray
from romgen.report.vtu import write_pvd, write_vtu
from romgen.structure import Modes, Preload, Structure
from romgen.trajectory import Trajectory


def _at_nodes(dof_values: FloatArray) -> FloatArray:
    """(n_dof,) values, degree of freedom 3 node + component, as (n_node, 3) vectors."""
    return dof_values.reshape(-1, 3)


def write_preload_field(directory: Path, structure: Structure, preload: Preload) -> Path:
    """Write preload.vtu with the static displacement in m and the stress in Pa on the undeformed mesh."""
    path = directory / "preload.vtu"
    fields = {"preload displacement [m]": _at_nodes(preload.displacement)}
    if len(preload.stress):
        fields |= {"Cauchy stress [Pa]": preload.stress, "von Mises stress [Pa]": von_mises(preload.stress)}
    write_vtu(path, structure, fields)
    return path


def von_mises(stress: FloatArray) -> FloatArray:
    """Von Mises stress (n_node,) of xx, yy, zz, xy, yz, xz, (n_node, 6), in Pa."""
    direct, shear = stress[:, :3], stress[:, 3:]
    differences = (direct - np.roll(direct, 1, axis=1)) ** 2
    return np.asarray(np.sqrt(0.5 * differences.sum(axis=1) + 3.0 * (shear**2).sum(axis=1)))


def write_mode_fields(directory: Path, structure: Structure, modes: Modes) -> Path:
    """Write modes.vtu with every mode shape, M-normalised, in 1/sqrt(kg)."""
    path = directory / "modes.vtu"
    fields = {
        f"mode {k + 1}, {frequency:.2f} Hz [kg^-0.5]": _at_nodes(modes.shapes[:, k])
        for k, frequency in enumerate(modes.frequency_hz)
    }
    write_vtu(path, structure, fields)
    return path


def write_snapshot_series(
    directory: Path, structure: Structure, trajectory: Trajectory, most: int = 40
) -> tuple[Path, ...]:
    """Write up to ``most`` snapshots of a ring-down as VTU and their PVD collection; empty without snapshots."""
    if trajectory.snapshots is None or trajectory.snapshot_index is None or not len(trajectory.snapshot_index):
        return ()
    chosen = np.unique(np.linspace(0, len(trajectory.snapshot_index) - 1, most).round().astype(np.int64))
    files = tuple(directory / f"{trajectory.name}_{row:05d}.vtu" for row in chosen)
    for row, path in zip(chosen, files, strict=True):
        write_vtu(path, structure, {"displacement [m]": trajectory.snapshots[row].reshape(-1, 3)})
    collection = directory / f"{trajectory.name}.pvd"
    write_pvd(collection, trajectory.t[trajectory.snapshot_index[chosen]].tolist(), files)
    return (collection, *files)
