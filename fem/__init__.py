"""Three-dimensional finite elements with contact, friction and large deflection.

The names below are what a case needs; docs/finite_elements.md sets one up.
"""

from fem.arc_length import EquilibriumPath, follow_path
from fem.block import graded, hex_block
from fem.bolt import Bolt, PreloadWarning
from fem.campaign import Observation, Starts, march_campaign, modal_coordinates, modal_starts, snap_back_starts
from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.contact_report import PenaltyReport, penalty_reports
from fem.equilibrium import InterfaceState, interface_states
from fem.errors import FemConvergenceError, FemError, FemInputError
from fem.excitation import SupportMotion, TimeLoad, base_load, support_motion, time_load
from fem.history import EnergyWarning, History, record_history
from fem.inp_writer import nodal_loads, write_inp
from fem.interfaces import Pair, Tie
from fem.loads import Clamp, FollowerPressure, Force, Gravity, PointForce, Pressure, Traction
from fem.material import Material
from fem.merge import merged
from fem.mesh import Mesh, within
from fem.modal_quantities import (
    effective_masses,
    frequency_response,
    mac,
    near_integer_ratios,
    participation_factors,
    total_masses,
)
from fem.model import Body, Model, build_model
from fem.modes import ModalBasis, Rayleigh, no_modes, rayleigh, rest_state, solve_modes
from fem.motion import MotionState, StepRecord
from fem.path_settings import PathSettings
from fem.preload import StaticSettings, StaticState, lock_bolts, solve_preload, solve_static
from fem.reach import ReachWarning, TieWarning
from fem.reaction import reaction, reaction_moment
from fem.read_mesh import read_mesh
from fem.sensor import Sensor, SensorWarning, sensor_rows
from fem.sliding import SlidingWarning
from fem.springs import Foundation, PointMass, Spring
from fem.stability import unstable_directions
from fem.stress import integration_point_stress, nodal_stress, point_stress
from fem.supports import Support
from fem.tightening import bolt_force
from fem.transient import Transient, TransientSettings

__all__ = [
    "Body",
    "Bolt",
    "Clamp",
    "EnergyWarning",
    "EquilibriumPath",
    "ExplicitSettings",
    "ExplicitTransient",
    "FemConvergenceError",
    "FemError",
    "FemInputError",
    "FollowerPressure",
    "Force",
    "Foundation",
    "Gravity",
    "History",
    "InterfaceState",
    "Material",
    "Mesh",
    "ModalBasis",
    "Model",
    "MotionState",
    "Observation",
    "Pair",
    "PathSettings",
    "PenaltyReport",
    "PointForce",
    "PointMass",
    "PreloadWarning",
    "Pressure",
    "Rayleigh",
    "ReachWarning",
    "Sensor",
    "SensorWarning",
    "SlidingWarning",
    "Spring",
    "Starts",
    "StaticSettings",
    "StaticState",
    "StepRecord",
    "Support",
    "SupportMotion",
    "Tie",
    "TieWarning",
    "TimeLoad",
    "Traction",
    "Transient",
    "TransientSettings",
    "base_load",
    "bolt_force",
    "build_model",
    "effective_masses",
    "follow_path",
    "frequency_response",
    "graded",
    "hex_block",
    "integration_point_stress",
    "interface_states",
    "lock_bolts",
    "mac",
    "march_campaign",
    "merged",
    "modal_coordinates",
    "modal_starts",
    "near_integer_ratios",
    "no_modes",
    "nodal_loads",
    "nodal_stress",
    "participation_factors",
    "penalty_reports",
    "point_stress",
    "rayleigh",
    "reaction",
    "reaction_moment",
    "read_mesh",
    "record_history",
    "rest_state",
    "sensor_rows",
    "snap_back_starts",
    "solve_modes",
    "solve_preload",
    "solve_static",
    "support_motion",
    "time_load",
    "total_masses",
    "unstable_directions",
    "within",
    "write_inp",
]
