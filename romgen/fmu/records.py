"""What goes into an exported unit besides the model, and what comes out of export and check."""

from __future__ import annotations

from dataclasses import dataclass, field

from romgen.arrays import FloatArray


@dataclass(frozen=True)
class FmuInfo:
    """What the description and the documentation page of a unit say beyond the equations.

    Attributes
    ----------
    description : one sentence on the structure.
    author, copyright, license : as shown by the importing tool.
    version : version of the model.
    origin : how the model was made, one entry per line of the documentation page.
    errors_percent : (trajectory, NMTE in percent) rows of the error table.
    input_range : (minimum, maximum) of each model input that the model was made for, SI units, or () where unknown.
    base_share : cosine between each sensor of the model and the motion of the base, for absolute outputs; () for 1.
    stop_time : s, of the default experiment.
    picture : PNG bytes of the icon; None for romgen's own.
    """

    description: str = "Reduced model of a nonlinear structure on a spectral submanifold"
    author: str = ""
    copyright: str = ""
    license: str = "see documentation/licenses/license.txt"
    version: str = "1.0"
    origin: tuple[str, ...] = ()
    errors_percent: tuple[tuple[str, float], ...] = ()
    input_range: tuple[tuple[float, float], ...] = ()
    base_share: tuple[float, ...] = ()
    stop_time: float = 1.0
    picture: bytes | None = None


@dataclass(frozen=True)
class InterfaceOptions:
    """What a unit shows beyond the model, and where it keeps its coefficients.

    Attributes
    ----------
    input_range : (minimum, maximum) of each model input that the model was made for, SI units, or () where unknown.
    base_share : for absolute outputs, the share of the motion of the base that each exported sensor sees; None without.
    start_from_sensors : start values are displacements and velocities of the sensors instead of the states.
    coefficients_in_file : the large tables are read from the resources instead of compiled in.
    """

    input_range: tuple[tuple[float, float], ...] = ()
    base_share: tuple[float, ...] | None = None
    start_from_sensors: bool = False
    coefficients_in_file: bool = False


PLAIN = InterfaceOptions()
"""Relative outputs, start values of the states, ranges not known."""


@dataclass(frozen=True)
class FmuExport:
    """One written unit.

    Attributes
    ----------
    path : the file.
    size_bytes : its size.
    sha256 : hash of the file.
    guid : identifier that binds description and binary.
    platforms : platforms with a binary, () for a source-only unit.
    compiler : what compiled them, or "none".
    notes : everything that differs from what was asked for, one sentence each.
    """

    path: str
    size_bytes: int
    sha256: str
    guid: str
    platforms: tuple[str, ...]
    compiler: str
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FmuReplay:
    """A motion computed by a unit.

    Attributes
    ----------
    t : (n_time,) s.
    state : (n_time, 2m) re z_1, im z_1, re z_2, ...
    displacement, velocity : (n_time, n_sensor) m and m/s.
    trust_ratio : (n_time,) distance measure of the trained range, 1 on its boundary.
    """

    t: FloatArray = field(metadata={"unit": "s", "axes": "time"})
    state: FloatArray = field(metadata={"unit": "1", "axes": "time,state"})
    displacement: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    velocity: FloatArray = field(metadata={"unit": "m/s", "axes": "time,sensor"})
    trust_ratio: FloatArray = field(metadata={"unit": "1", "axes": "time"})


@dataclass(frozen=True)
class LevelRow:
    """One check of a validation level; it is passed where abs(value - target) <= limit.

    Attributes
    ----------
    level : "L0" structure and binary, "L1" kernel and trajectory, "L2" state and use, "L3" importers and inputs;
        in a study "L0 FMI 3.0" and so on for the second unit.
    check : what was compared with what.
    value, target, limit : the figure, what it should be, and how far it may be off.
    """

    level: str
    check: str
    value: float
    target: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the limit holds; a figure that is not a number does not pass."""
        return abs(self.value - self.target) <= self.limit


@dataclass(frozen=True)
class FmuLevels:
    """All checks of one unit, and what could not be checked here.

    Attributes
    ----------
    rows : in the order of the levels.
    problems : the sentences behind the counts of L0.
    notes : what was left out and why.
    """

    rows: tuple[LevelRow, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every row passed."""
        return all(row.passed for row in self.rows)


@dataclass(frozen=True)
class FmuCheck:
    """How far exported units are from the standard and from the Python model under the same input.

    Each error is the largest absolute difference of a quantity over the run divided by its largest magnitude, then the
    largest over states, displacements and velocities (a quantity that hardly moves counts relative to the others).

    Attributes
    ----------
    fmpy_problems : what fmpy's validator says about the native unit.
    native_vs_python_rel : largest of the three runs below.
    native_free_rel : zero input from a start state.
    native_held_rel, native_linear_rel : forced, input held in each step, or linear through input derivatives.
    pythonfmu_problems, pythonfmu_vs_python_rel : the same for the pythonfmu unit (free and held), () and None without.
    step_size, n_step : s and number of communication steps of each run.
    """

    fmpy_problems: tuple[str, ...]
    native_vs_python_rel: float
    native_free_rel: float
    native_held_rel: float
    native_linear_rel: float
    pythonfmu_problems: tuple[str, ...]
    pythonfmu_vs_python_rel: float | None
    step_size: float
    n_step: int
