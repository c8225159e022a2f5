"""What the finite-element half hands to the learning half: geometry, preload, modes, ring-downs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from romgen.arrays import FloatArray, IntArray
from romgen.trajectory import Trajectory

# Frequencies within this share of a ratio of small integers count as near it.
RATIO_TOLERANCE = 0.1


@dataclass(frozen=True)
class Structure:
    """The mesh as pictures and field output need it; degree of freedom 3 node + component.

    Attributes
    ----------
    points : (n_node, 3) m, undeformed.
    cells : (n_cell, n_local) node numbers in VTK order; rows of smaller cells end in -1.
    cell_types : "hex20", "hex27" or "tet10" of each body.
    cell_body : (n_cell,) index into ``bodies``.
    bodies : names of the bodies.
    skin : (n_triangle, 3) corner nodes of the outer surface.
    """

    points: FloatArray = field(metadata={"unit": "m", "axes": "node,direction"})
    cells: IntArray = field(metadata={"unit": "1", "axes": "cell,local node"})
    cell_types: tuple[str, ...]
    cell_body: IntArray = field(metadata={"unit": "1", "axes": "cell"})
    bodies: tuple[str, ...]
    skin: IntArray = field(metadata={"unit": "1", "axes": "triangle,corner"})


@dataclass(frozen=True)
class Interface:
    """State of one frictional interface at its integration points.

    Attributes
    ----------
    name : name of the contact pair.
    points : (n_point, 3) m.
    area : (n_point,) m^2, integration weight.
    pressure : (n_point,) Pa, compression positive.
    traction : (n_point, 2) Pa, along the two tangents of the pair.
    gap : (n_point,) m, penetration negative.
    status : (n_point,) 0 open, 1 stick, 2 slip.
    normal_force_n : resultant of the pressure, N.
    applied_force_n : what the loads across it sum to, N (nan where that is not determined).
    contact_area_m2 : area of the closed points, m^2.
    """

    name: str
    points: FloatArray = field(metadata={"unit": "m", "axes": "point,direction"})
    area: FloatArray = field(metadata={"unit": "m^2", "axes": "point"})
    pressure: FloatArray = field(metadata={"unit": "Pa", "axes": "point"})
    traction: FloatArray = field(metadata={"unit": "Pa", "axes": "point,tangent"})
    gap: FloatArray = field(metadata={"unit": "m", "axes": "point"})
    status: IntArray = field(metadata={"unit": "1", "axes": "point"})
    normal_force_n: float
    applied_force_n: float
    contact_area_m2: float


@dataclass(frozen=True)
class Preload:
    """Static equilibrium under the clamping loads.

    Attributes
    ----------
    displacement : (n_dof,) m from the undeformed mesh.
    interfaces : state of each contact pair.
    load_factors : (n_step,) load factor of each converged step.
    residuals : (n_iteration,) relative residual of each Newton iteration of all steps.
    stress : (n_node, 6) Cauchy stress at the nodes, xx, yy, zz, xy, yz, xz; empty where it was not recovered.
    bolt_shortening : (n_bolt,) m by which each bolt was tightened and is locked.
    """

    displacement: FloatArray = field(metadata={"unit": "m", "axes": "dof"})
    interfaces: tuple[Interface, ...]
    load_factors: FloatArray = field(metadata={"unit": "1", "axes": "step"})
    residuals: FloatArray = field(metadata={"unit": "1", "axes": "iteration"})
    stress: FloatArray = field(
        default_factory=lambda: np.empty((0, 6)), metadata={"unit": "Pa", "axes": "node,component"}
    )
    bolt_shortening: FloatArray = field(default_factory=lambda: np.empty(0), metadata={"unit": "m", "axes": "bolt"})


@dataclass(frozen=True)
class FrequencyRatio:
    """Two modes, counted from 0, with f_second / f_first = (high / low) (1 + detuning), low and high coprime."""

    first: int
    second: int
    low: int
    high: int
    detuning: float


@dataclass(frozen=True)
class Modes:
    """Undamped modes of the tangent at the preloaded state with stuck contact.

    Attributes
    ----------
    frequency_hz : (n_mode,) ascending.
    damping_ratio : (n_mode,) from C = alpha M + beta K.
    shapes : (n_dof, n_mode), Phi' M Phi = I, 1/sqrt(kg).
    left : (n_dof, n_mode) M Phi: eta = left' q.
    modal_load : (n_mode, n_input) Phi' f per unit input; base acceleration: -Phi' M b.
    inputs, input_units : names and SI units of the load inputs.
    sensors : names of the sensors.
    sensor_matrix : (n_sensor, n_dof) x = S q, dense rows (few sensors).
    alpha, beta : Rayleigh coefficients, 1/s and s.
    effective_mass : (n_mode, 3) kg that moves with each mode along x, y, z; empty where it was not computed.
    total_mass : kg.
    near_ratios : pairs of modes near a ratio of small integers, the nearest first.
    """

    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "mode"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "mode"})
    shapes: FloatArray = field(metadata={"unit": "kg^-0.5", "axes": "dof,mode"})
    left: FloatArray = field(metadata={"unit": "kg^0.5", "axes": "dof,mode"})
    modal_load: FloatArray = field(metadata={"unit": "kg^0.5 per input", "axes": "mode,input"})
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    sensors: tuple[str, ...]
    sensor_matrix: FloatArray = field(metadata={"unit": "1", "axes": "sensor,dof"})
    alpha: float
    beta: float
    effective_mass: FloatArray = field(
        default_factory=lambda: np.empty((0, 3)), metadata={"unit": "kg", "axes": "mode,direction"}
    )
    total_mass: float = float("nan")
    near_ratios: tuple[FrequencyRatio, ...] = ()


@dataclass(frozen=True)
class EnergyLedger:
    """Energies in J at every time of a transient; imbalance = what the scheme itself gains or loses.

    imbalance = kinetic + strain + contact + friction + damping - external - initial sum.
    All arrays (n_time,): kinetic, strain and contact are stored, relative to the preloaded state; friction and damping
    are dissipated since t = 0; external is the work of the dead loads and of the base since t = 0.
    """

    kinetic: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    strain: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    contact: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    friction: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    damping: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    external: FloatArray = field(metadata={"unit": "J", "axes": "time"})
    imbalance: FloatArray = field(metadata={"unit": "J", "axes": "time"})


@dataclass(frozen=True)
class StepEffort:
    """Steps of the scheme since the sample before, rejected ones, and factors of the current tangent, (n_time,) each.

    One step per sample, unless it did not converge or its local error was too large and it was halved.
    """

    steps: npt.NDArray[np.int64] = field(metadata={"unit": "1", "axes": "time"})
    rejected: npt.NDArray[np.int64] = field(metadata={"unit": "1", "axes": "time"})
    factors: npt.NDArray[np.int64] = field(metadata={"unit": "1", "axes": "time"})


@dataclass(frozen=True)
class RingDown:
    """One computed free decay with its energies and solver statistics.

    Attributes
    ----------
    trajectory : the motion, relative to the preloaded state.
    energy : its ledger.
    iterations : (n_time,) corrector iterations since the sample before, 0 for the initial state.
    effort : what the samples took, common to all decays that marched together.
    """

    trajectory: Trajectory
    energy: EnergyLedger
    iterations: npt.NDArray[np.int64] = field(metadata={"unit": "1", "axes": "time"})
    effort: StepEffort
