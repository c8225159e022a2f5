"""One observed motion of the structure, from the FE model, another code or the lab."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from romgen.arrays import FloatArray, IntArray
from romgen.errors import InputError

# Displacements between these, in m, have squares of accelerations and of spectra within double precision, whose range
# is 1e-308 to 1e308: 1e100 is left for the squares of time steps and for the number of samples.
SMALLEST, LARGEST = 1e-100, 1e100


@dataclass(frozen=True)
class Trajectory:
    """A free decay (or any motion) at named sensors and, if known, in modal coordinates.

    Displacements are relative to the rest state (the preloaded equilibrium, which is 0).

    Attributes
    ----------
    name : identifier, unique in a study.
    t : (n_time,) s, strictly increasing.
    sensors : names of the n_sensor columns.
    displacement : (n_time, n_sensor) m.
    velocity : (n_time, n_sensor) m/s, or None where it was not recorded.
    eta, eta_dot, eta_ddot : (n_time, n_mode) modal displacement Phi' M q, velocity and
        acceleration (m sqrt(kg) and per s, s^2), or None without an FE model.
    snapshots : (n_snapshot, n_dof) float32 full displacement in m, or None.
    snapshot_index : (n_snapshot,) row of ``t`` of each snapshot, or None.
    """

    name: str
    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    sensors: tuple[str, ...]
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    velocity: FloatArray | None = field(default=None, metadata={"unit": "m/s", "axes": "time,sensor"})
    eta: FloatArray | None = field(default=None, metadata={"unit": "m kg^0.5", "axes": "time,mode"})
    eta_dot: FloatArray | None = field(default=None, metadata={"unit": "m kg^0.5/s", "axes": "time,mode"})
    eta_ddot: FloatArray | None = field(default=None, metadata={"unit": "m kg^0.5/s^2", "axes": "time,mode"})
    snapshots: npt.NDArray[np.float32] | None = field(default=None, metadata={"unit": "m", "axes": "snapshot,dof"})
    snapshot_index: IntArray | None = field(default=None, metadata={"unit": "1", "axes": "snapshot"})


def check_magnitude(displacement: FloatArray, where: str) -> None:
    """Refuse displacements (n_time, n_sensor) in m whose squares leave double precision.

    Raises
    ------
    InputError : the largest is above 1e100 m, or below 1e-100 m.
    """
    largest = float(np.abs(displacement).max(initial=0.0))
    if largest != 0.0 and not SMALLEST <= largest <= LARGEST:
        raise InputError(
            "displacements too large or too small to compute with",
            where=where,
            value=f"at most {largest:.3g} m",
            advice="check the unit of the displacements",
        )
