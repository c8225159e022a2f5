"""What the report is written from; every absent stage is simply left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from romgen.arrays import FloatArray
from romgen.backbone import Backbone
from romgen.confidence_band import ConfidenceBand
from romgen.fmu.records import FmuCheck, FmuExport, FmuLevels
from romgen.forced_curve import ForcedResponse
from romgen.forced_validation import ForcedPoint
from romgen.lifted_orbit import Measure
from romgen.load_calibration import InputLoad
from romgen.load_histories import HistoryComparison
from romgen.provenance import Provenance
from romgen.reduced_model import ReducedModel
from romgen.settings import AcceptanceSettings
from romgen.structure import Modes, Preload, RingDown, Structure
from romgen.trajectory import Trajectory

Role = Literal["training", "validation"]


@dataclass(frozen=True)
class Reconstruction:
    """One recorded motion and what the reduced model makes of its initial state.

    Attributes
    ----------
    trajectory : the motion of the FE model or of the lab.
    displacement : (n_time, n_sensor) m, the reduced model at the same times and sensors.
    nmte_percent : normalised mean trajectory error in the coordinates the study judges by.
    role : whether the model has seen this motion.
    """

    trajectory: Trajectory
    displacement: FloatArray
    nmte_percent: float
    role: Role

    @property
    def main_sensor(self) -> int:
        """Column with the largest recorded motion."""
        return int(np.argmax(np.abs(self.trajectory.displacement).max(axis=0)))


@dataclass(frozen=True)
class StageCost:
    """What one stage took: wall time in s and the largest memory of the process in bytes."""

    name: str
    wall_s: float
    peak_memory_bytes: int


@dataclass(frozen=True)
class OrderTrial:
    """One polynomial order that was tried, its cross-validated error in percent, and whether the model has it.

    ``stable`` tells whether all free motions from the boundary of the trained range decay.
    """

    order: int
    error_percent: float
    chosen: bool
    stable: bool = True


@dataclass(frozen=True)
class ReportInputs:
    """Everything a report can show; only the name of the study is required.

    Attributes
    ----------
    study : name of the study.
    title : headline; the name of the study where there is none.
    structure, preload, modes : the finite-element stages; absent for recorded data.
    ring_downs : the computed transients with their energies.
    reconstructions : recorded motions against the reduced model.
    model : the reduced model.
    polar_form : the normal form in polar coordinates as text.
    resonance_reason : one sentence on how the kept terms were chosen.
    coefficient_deviation : (m, n_term) 1/s, standard deviation of abs of each normal-form coefficient.
    orders : the polynomial orders that were tried.
    loads : load inputs of a model of recorded data.
    forced : frequency response at all levels.
    forced_points : points of it that the finite-element model computed too.
    histories : load histories that both models followed.
    backbones : free vibration of the reduced model, one per mode and kind; bands : confidence limits of each, or ().
    sensor, measure : where and how amplitudes are observed; None takes the sensor that sees most.
    fmu_export, pythonfmu_export, fmu_check : the exported units and how well they repeat the Python model.
    fmu_levels : validation levels L0 to L3 of the native unit; fmi3_export : the FMI 3.0 unit.
    fmu_replays : held-out trajectory -> NMTE in percent of its sensors rebuilt by the native unit.
    stages : cost of each stage, in running order.
    warnings : one line per thing a reader must know.
    provenance : versions, hashes and machine.
    command : the line that makes this report again.
    vtu : whether field files for ParaView are written.
    limits : what the headline numbers are judged by.
    """

    study: str
    title: str | None = None
    structure: Structure | None = None
    preload: Preload | None = None
    modes: Modes | None = None
    ring_downs: tuple[RingDown, ...] = ()
    reconstructions: tuple[Reconstruction, ...] = ()
    model: ReducedModel | None = None
    polar_form: str = ""
    resonance_reason: str = ""
    coefficient_deviation: FloatArray | None = None
    orders: tuple[OrderTrial, ...] = ()
    loads: tuple[InputLoad, ...] = ()
    forced: ForcedResponse | None = None
    forced_points: tuple[ForcedPoint, ...] = ()
    histories: tuple[HistoryComparison, ...] = ()
    backbones: tuple[Backbone, ...] = ()
    bands: tuple[ConfidenceBand, ...] = ()
    sensor: str | None = None
    measure: Measure = "sqrt2_rms"
    fmu_export: FmuExport | None = None
    pythonfmu_export: FmuExport | None = None
    fmu_check: FmuCheck | None = None
    fmu_levels: FmuLevels | None = None
    fmi3_export: FmuExport | None = None
    fmu_replays: Mapping[str, float] = field(default_factory=dict)
    stages: tuple[StageCost, ...] = ()
    warnings: tuple[str, ...] = ()
    provenance: Provenance | None = None
    command: str = "romgen run study.toml"
    vtu: bool = True
    limits: AcceptanceSettings = field(default_factory=AcceptanceSettings)
