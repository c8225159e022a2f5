"""The whole study file as one frozen record."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from romgen.settings.base import Settings
from romgen.settings.data import DataSettings
from romgen.settings.finite_elements import (
    BaseAccelerationSettings,
    BlockSettings,
    ConstraintSettings,
    ExcitationSettings,
    LoadSettings,
    MaterialSettings,
    ModesSettings,
    PreloadSettings,
    RingDownSettings,
    SensorSettings,
)
from romgen.settings.forcing import ForcingSettings
from romgen.settings.joints import (
    BoltSettings,
    ContactSettings,
    FoundationSettings,
    PointMassSettings,
    SpringSettings,
    TieSettings,
)
from romgen.settings.learning import (
    AcceptanceSettings,
    FmuSettings,
    ForcedResponseSettings,
    ForcedValidationSettings,
    LearnSettings,
    LoadHistorySettings,
    ReportSettings,
)
from romgen.settings.mesh_files import MeshSettings, RegionSettings

BASE_ACCELERATION = "base_acceleration"
"""Name of the load input of table [base_acceleration]."""


class StudySettings(Settings):
    """Table [study]: the name of the run folder and of the FMU; ``extends`` names a study to start from."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    extends: str | None = None


class Study(Settings):
    """All tables of study.toml: either a finite-element model (blocks or meshes, ringdowns) or recorded data."""

    study: StudySettings
    materials: dict[str, MaterialSettings] = Field(default_factory=dict)
    blocks: dict[str, BlockSettings] = Field(default_factory=dict)
    meshes: dict[str, MeshSettings] = Field(default_factory=dict)
    regions: dict[str, RegionSettings] = Field(default_factory=dict)
    contacts: dict[str, ContactSettings] = Field(default_factory=dict)
    ties: dict[str, TieSettings] = Field(default_factory=dict)
    bolts: dict[str, BoltSettings] = Field(default_factory=dict)
    springs: dict[str, SpringSettings] = Field(default_factory=dict)
    foundations: dict[str, FoundationSettings] = Field(default_factory=dict)
    point_masses: dict[str, PointMassSettings] = Field(default_factory=dict)
    constraints: tuple[ConstraintSettings, ...] = ()
    loads: tuple[LoadSettings, ...] = ()
    preload: PreloadSettings = PreloadSettings()
    modes: ModesSettings = ModesSettings()
    sensors: dict[str, SensorSettings] = Field(default_factory=dict)
    base_acceleration: BaseAccelerationSettings | None = None
    excitations: dict[str, ExcitationSettings] = Field(default_factory=dict)
    ringdowns: RingDownSettings | None = None
    data: DataSettings | None = None
    forcing: dict[str, ForcingSettings] = Field(default_factory=dict)
    learn: LearnSettings = LearnSettings()
    forced_response: ForcedResponseSettings = ForcedResponseSettings()
    forced_validation: ForcedValidationSettings | None = None
    load_histories: dict[str, LoadHistorySettings] = Field(default_factory=dict)
    fmu: FmuSettings = FmuSettings()
    report: ReportSettings = ReportSettings()
    acceptance: AcceptanceSettings = AcceptanceSettings()

    @model_validator(mode="after")
    def _model_or_data(self) -> Self:
        bodies = bool(self.blocks or self.meshes)
        if self.data is not None and (bodies or self.ringdowns is not None):
            raise ValueError("has both [data] and a finite-element model; keep one of them")
        if self.forcing and self.data is None:
            raise ValueError("has [forcing] but no [data]: a finite-element model computes its loads; remove the table")
        if self.data is None and not bodies:
            raise ValueError("has neither [data] nor [blocks.<name>] or [meshes.<name>]; add one of them")
        if bodies and self.ringdowns is None:
            raise ValueError("has [blocks] or [meshes] but no [ringdowns]; add the table")
        both = sorted(set(self.blocks) & set(self.meshes))
        if both:
            raise ValueError(f"has a block and a mesh of the same name: {', '.join(both)}")
        return self

    @property
    def name(self) -> str:
        """Identifier of the study: letters, digits, underscore."""
        return self.study.name

    @property
    def bodies(self) -> dict[str, BlockSettings | MeshSettings]:
        """All bodies, blocks first."""
        return {**self.blocks, **self.meshes}

    @property
    def load_inputs(self) -> dict[str, str]:
        """Names of the load inputs and their SI units: the acceleration of the base first."""
        base = {} if self.base_acceleration is None else {BASE_ACCELERATION: "m/s2"}
        known = {name: "m/s2" if name == BASE_ACCELERATION else "N" for name in self.forcing}
        return base | {name: table.unit for name, table in self.excitations.items()} | known

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Names of the sensors, in the order of the columns of every trajectory."""
        return self.data.sensors if self.data is not None else tuple(self.sensors)
