"""A small synthetic study: two blocks clamp a shallow arch that decays in two resonant modes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.backbone import backbone
from romgen.fmu.records import FmuCheck, FmuExport
from romgen.forced_response import forced_response
from romgen.load_calibration import CalibratedPoint, InputLoad
from romgen.load_histories import HistoryComparison, compare_history
from romgen.polynomial import PolynomialMap
from romgen.provenance import collect_provenance
from romgen.reduced_model import ReducedModel
from romgen.report import OrderTrial, Reconstruction, ReportInputs, StageCost
from romgen.settings import ForcedResponseSettings, LoadHistorySettings
from romgen.structure import EnergyLedger, FrequencyRatio, Interface, Modes, Preload, RingDown, StepEffort, Structure
from romgen.trajectory import Trajectory

PEAK = CalibratedPoint(
    level=2.0,
    unit="m/s2",
    frequency_hz=109.1,
    peak=True,
    resonance_hz=109.3,
    sensor="mid",
    measure="sqrt2_rms",
    measured_m=0.3e-3,
    model_m=float("nan"),
    level_needed=2.05,
    deviation_percent=2.5,
    expected_percent=2.8,
    by_amplitude=1.0,
    by_frequency=0.0,
    input_change_percent=0.4,
    mode=1,
    distance=1.1,
    stable=False,
)
LOADS = (
    InputLoad("base_acceleration", "m/s2", "points", np.array([-1.3, 0.0]), np.array([2.8, np.nan]), 2.5, (PEAK,), ()),
    InputLoad("hammer", "N", "participation", np.array([0.8, 0.1]), np.full(2, np.nan), float("nan"), (), ()),
)
# Local corners and edge midpoints of the 20-node hexahedron on the grid 0, 1, 2, VTK order.
HEX20_CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
HEX20_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def hex20_offsets() -> IntArray:
    """(20, 3) position of the local nodes on the grid 0, 1, 2."""
    corners = np.array(HEX20_CORNERS)
    middles = [(corners[i] + corners[j]) // 2 for i, j in HEX20_EDGES]
    return np.vstack([corners, middles])


def hex20_box(counts: tuple[int, int, int], low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Nodes and cells of a box of 20-node hexahedra; unused grid points are dropped."""
    grid = tuple(2 * n + 1 for n in counts)
    axes = [np.linspace(low[k], high[k], grid[k]) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    offsets = hex20_offsets()
    origins = 2 * np.array(list(itertools.product(*(range(n) for n in counts))))
    cells = np.ravel_multi_index(tuple(np.moveaxis(origins[:, None] + offsets, -1, 0)), grid)
    used, flat = np.unique(cells, return_inverse=True)
    return points[used], flat.reshape(cells.shape)


def outer_triangles(cells: IntArray) -> IntArray:
    """Two triangles per quadrilateral that belongs to one cell only."""
    quads = cells[:, np.array(_FACES)].reshape(-1, 4)
    _, index, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    outer = quads[index[count == 1]]
    return np.vstack([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])


@pytest.fixture(scope="session")
def structure() -> Structure:
    """A 300 mm arch with 1 mm rise between two 50 mm blocks at one end, all 20-node hexahedra."""
    panel, panel_cells = hex20_box((16, 5, 1), np.array([-0.05, 0.0, 0.0]), np.array([0.3, 0.1, 0.0015]))
    free = panel[:, 0] > 0.0
    panel[free, 2] += 1e-3 * np.sin(np.pi * panel[free, 0] / 0.3)
    lower, lower_cells = hex20_box((2, 3, 2), np.array([-0.05, 0.0, -0.02]), np.array([0.0, 0.1, 0.0]))
    upper, upper_cells = hex20_box((2, 3, 2), np.array([-0.05, 0.0, 0.0015]), np.array([0.0, 0.1, 0.0215]))
    cells = np.vstack([panel_cells, lower_cells + len(panel), upper_cells + len(panel) + len(lower)])
    body = np.repeat([0, 1, 2], [len(panel_cells), len(lower_cells), len(upper_cells)])
    points = np.vstack([panel, lower, upper])
    return Structure(points, cells, ("hex20",) * 3, body, ("panel", "support", "blade"), outer_triangles(cells))


def _interface(name: str, z: float, force: float) -> Interface:
    """A clamping face that opens towards its free edge."""
    x, y = np.meshgrid(np.linspace(-0.0475, -0.0025, 10), np.linspace(0.0025, 0.0975, 20), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])
    area = np.full(x.size, 0.05 * 0.1 / x.size)
    raw = np.maximum(np.cos(np.pi * (points[:, 0] + 0.025) / 0.05), 0.0) - 0.15
    pressure = np.maximum(raw, 0.0) * force / np.sum(np.maximum(raw, 0.0) * area)
    status = np.where(pressure == 0.0, 0, np.where(pressure < 0.2 * pressure.max(), 2, 1))
    traction = 0.1 * np.column_stack([pressure, -pressure])
    gap = np.where(pressure > 0.0, -pressure / 1e13, 1e-6)
    return Interface(
        name, points, area, pressure, traction, gap, status, force, force * 1.0004, float(area[status > 0].sum())
    )


@pytest.fixture(scope="session")
def preload(structure: Structure) -> Preload:
    """Two interfaces under 54.6 kN and a quadratically converging residual."""
    residuals = np.tile([1.0, 1e-2, 1e-5, 1e-11], 3) * np.repeat([1.0, 0.5, 0.3], 4)
    interfaces = (_interface("support_face", 0.0, 54.6e3), _interface("blade_face", 0.0015, 54.6e3))
    displacement = np.zeros(structure.points.size)
    displacement[2::3] = -1e-6 * structure.points[:, 2]
    return Preload(displacement, interfaces, np.array([1 / 3, 2 / 3, 1.0]), residuals)


@pytest.fixture(scope="session")
def modes(structure: Structure) -> Modes:
    """A bending, a torsion and a second bending shape."""
    x, y = np.maximum(structure.points[:, 0], 0.0) / 0.3, structure.points[:, 1] / 0.1 - 0.5
    transverse = [np.sin(np.pi * x), 2.0 * np.sin(np.pi * x) * y, np.sin(2.0 * np.pi * x)]
    shapes = np.zeros((structure.points.size, 3))
    shapes[2::3] = np.stack(transverse, axis=-1)
    sensors = np.zeros((2, structure.points.size))
    load = np.array([[-0.31], [0.002], [-0.05]])
    frequency, damping = np.array([109.7, 198.8, 302.0]), np.array([0.004, 0.004, 0.0052])
    names = ("base_acceleration",), ("m/s2",), ("mid", "corner")
    near = (FrequencyRatio(0, 1, 1, 2, -0.0939),)
    return Modes(frequency, damping, shapes, shapes, load, *names, sensors, 3.5, 4e-6, near_ratios=near)


def decay(name: str, amplitudes: tuple[float, float], shift: float = 0.0) -> Trajectory:
    """Two decaying, softening modes seen by a middle and a corner sensor."""
    t = np.linspace(0.0, 1.2, 6001)
    waves = [a * np.exp(-r * t) for a, r in zip(amplitudes, (2.76, 5.0), strict=True)]
    phase = [2 * np.pi * (f * t - 3.0 * (1 - np.exp(-2 * t))) * (1 + shift) for f in (109.7, 198.8)]
    eta = [w * np.cos(p) for w, p in zip(waves, phase, strict=True)]
    return Trajectory(name, t, ("mid", "corner"), np.column_stack([eta[0], eta[0] + eta[1]]))


@pytest.fixture(scope="session")
def reconstructions() -> tuple[Reconstruction, ...]:
    """Two training motions and one validation motion with a small phase error."""
    cases = (("bending", (2e-3, 1e-5), "training"), ("torsion", (1e-4, 1.5e-3), "training"))
    seen = [(decay(n, a), decay(n, a, 2e-4), role, 1.1) for n, a, role in cases]
    unseen = [(decay("mixed", (1.4e-3, 8e-4)), decay("mixed", (1.4e-3, 8e-4), 5e-4), "validation", 2.9)]
    return tuple(Reconstruction(t, rom.displacement, nmte, role) for t, rom, role, nmte in seen + unseen)


@pytest.fixture(scope="session")
def ring_downs(reconstructions: tuple[Reconstruction, ...]) -> tuple[RingDown, ...]:
    """The first motion with energies that balance but for a small drift, and full snapshots."""
    trajectory = reconstructions[0].trajectory
    t = trajectory.t
    stored = 0.02 * np.exp(-5.5 * t)
    kinetic = stored * np.sin(2 * np.pi * 109.7 * t) ** 2
    lost, drift, zero = 0.02 - stored, 1e-7 * t, np.zeros_like(t)
    ledger = EnergyLedger(
        kinetic, 0.97 * (stored - kinetic), 0.03 * (stored - kinetic), 0.3 * lost, 0.7 * lost, zero, drift
    )
    one, none = np.r_[0, np.ones(t.size - 1, np.int64)], np.zeros(t.size, np.int64)
    return (RingDown(trajectory, ledger, 3 * one, StepEffort(one, none, none)),)


@pytest.fixture(scope="session")
def model() -> ReducedModel:
    """A 1:2 model with the cubic and quadratic terms of both modes."""
    linear = np.vstack([np.eye(4, dtype=np.int64)])
    terms = np.array([[0, 1, 1, 0], [2, 0, 1, 0], [1, 1, 0, 1], [2, 0, 0, 0], [0, 2, 0, 1], [1, 1, 1, 0]])
    values: ComplexArray = np.zeros((2, 6), dtype=complex)
    values[0, :3] = [-3 + 40j, -20 - 900j, -10 + 300j]
    values[1, 3:] = [-2 + 25j, -30 - 500j, -5 + 200j]
    chart = np.hstack([np.eye(4)[:, :2], np.zeros((4, 2))]).astype(complex)
    inverse = np.hstack([np.eye(2), 1j * np.eye(2)])
    sensors = np.array([[1e-3, 0.0, 0.0, 0.0], [1e-3, 1e-3, 0.0, 0.0]])
    return ReducedModel(
        "arch",
        np.array([-2.76 + 689.3j, -5.0 + 1249.1j]),
        PolynomialMap(terms, values),
        PolynomialMap(linear, chart),
        PolynomialMap(linear, inverse),
        np.ones(4),
        PolynomialMap(linear, sensors),
        PolynomialMap(linear, 700.0 * sensors[:, [2, 3, 0, 1]]),
        ("mid", "corner"),
        ("base_acceleration",),
        ("m/s2",),
        np.array([[0.1 - 0.2j], [0.001j]]),
        (1, 2),
        np.array([0.8, 0.5]),
    )


@pytest.fixture(scope="session")
def stages() -> tuple[StageCost, ...]:
    """Six stages of uneven cost."""
    names = ("preload", "modes", "ring_downs", "learn", "forced_response", "fmu")
    walls = (14.2, 3.1, 148.0, 22.5, 4.8, 9.6)
    return tuple(
        StageCost(n, w, int((300 + 60 * k) * 2**20)) for k, (n, w) in enumerate(zip(names, walls, strict=True))
    )


def _history(model: ReducedModel) -> HistoryComparison:
    """A pulse on the base that both models follow, the second 3 % less far."""
    pulse = LoadHistorySettings(input=model.inputs[0], times=(0.0, 2e-3, 4e-3), values=(0.0, 1.0, 0.0), duration=0.02)
    t = np.linspace(0.0, 0.02, 401)
    own = compare_history(model, "pulse", pulse, t, np.ones((401, len(model.sensors)))).rom
    return compare_history(model, "pulse", pulse, t, 0.97 * own)


@pytest.fixture(scope="session")
def full_inputs(
    structure: Structure,
    preload: Preload,
    modes: Modes,
    ring_downs: tuple[RingDown, ...],
    reconstructions: tuple[Reconstruction, ...],
    model: ReducedModel,
    stages: tuple[StageCost, ...],
) -> ReportInputs:
    """A study with every stage."""
    return ReportInputs(
        study="clamped_arch",
        title="Clamped arch",
        structure=structure,
        preload=preload,
        modes=modes,
        ring_downs=ring_downs,
        reconstructions=reconstructions,
        model=model,
        polar_form="rho_1' = -2.76 rho_1 - 20 rho_1^3\ntheta_1' = 689.3 - 900 rho_1^2",
        resonance_reason="exact 1:2 combinations",
        coefficient_deviation=0.01 * np.abs(model.normal_form.coefficients),
        orders=(OrderTrial(3, 6.0, False), OrderTrial(5, 2.9, True)),
        loads=LOADS,
        forced=forced_response(model, ForcedResponseSettings(levels=(1.0, 2.0), sensor="mid")),
        histories=(_history(model),),
        backbones=(backbone(model, 0), backbone(model, 0, slaved=True), backbone(model, 1)),
        fmu_export=FmuExport("clamped_arch.fmu", 181_204, "ab" * 32, "{1234}", ("linux64", "win64"), "zig 0.13", ()),
        fmu_check=FmuCheck((), 3.1e-12, 1e-12, 2e-12, 3.1e-12, (), 4e-10, 1e-4, 2000),
        fmu_replays={"mixed": 2.93},
        stages=stages,
        warnings=("validation motion 'mixed' starts outside the trained range of mode 2",),
        provenance=collect_provenance("0123456789abcdef", "{}", {"folds": 0}),
        command="romgen run models/clamped_arch/study.toml",
    )
