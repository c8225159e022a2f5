"""Three-dimensional finite elements with contact, friction and large deflection.

The names below are what a case needs; docs/finite_elements.md sets one up.
"""

from fem.arc_length import EquilibriumPath, PathSettings, follow_path
from fem.block import graded, hex_block
from fem.bolt import Bolt
from fem.errors import FemConvergenceError, FemError, FemInputError
from fem.interfaces import Pair, Tie
from fem.loads import Clamp, Force, Gravity, PointForce, Pressure, Traction
from fem.material import Material
from fem.merge import merged
from fem.mesh import Mesh, within
from fem.modal_quantities import effective_masses, mac, near_integer_ratios, participation_factors, total_masses
from fem.model import Body, Model, build_model
from fem.modes import ModalBasis, rayleigh, rest_state, solve_modes
from fem.preload import StaticSettings, StaticState, solve_static
from fem.reaction import reaction
from fem.read_mesh import read_mesh
from fem.sensor import Sensor, sensor_rows
from fem.stress import integration_point_stress, nodal_stress
from fem.supports import Support

__all__ = [
    "Body",
    "Bolt",
    "Clamp",
    "EquilibriumPath",
    "FemConvergenceError",
    "FemError",
    "FemInputError",
    "Force",
    "Gravity",
    "Material",
    "Mesh",
    "ModalBasis",
    "Model",
    "Pair",
    "PathSettings",
    "PointForce",
    "Pressure",
    "Sensor",
    "StaticSettings",
    "StaticState",
    "Support",
    "Tie",
    "Traction",
    "build_model",
    "effective_masses",
    "follow_path",
    "graded",
    "hex_block",
    "integration_point_stress",
    "mac",
    "merged",
    "near_integer_ratios",
    "nodal_stress",
    "participation_factors",
    "rayleigh",
    "reaction",
    "read_mesh",
    "rest_state",
    "sensor_rows",
    "solve_modes",
    "solve_static",
    "total_masses",
    "within",
]
