"""The tables of study.toml as frozen, strict records, and the checks before anything is computed."""

from romgen.settings.base import Settings
from romgen.settings.checks import named_surfaces, study_warnings, surfaces, unknown
from romgen.settings.data import DataSettings
from romgen.settings.estimate import Estimate, estimate
from romgen.settings.finite_elements import (
    ArchSettings,
    BaseAccelerationSettings,
    BlockSettings,
    ConstraintSettings,
    ExcitationSettings,
    LoadSettings,
    MaterialSettings,
    ModesSettings,
    PreloadSettings,
    RingDownSettings,
    RingDownStart,
    SensorSettings,
)
from romgen.settings.forcing import ForcedPointSettings, ForcingSettings
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
from romgen.settings.load import StudyError, load_study
from romgen.settings.mesh_files import MeshSettings, RegionSettings
from romgen.settings.points import named_points
from romgen.settings.study import BASE_ACCELERATION, Study, StudySettings

__all__ = [
    "BASE_ACCELERATION",
    "AcceptanceSettings",
    "ArchSettings",
    "BaseAccelerationSettings",
    "BlockSettings",
    "BoltSettings",
    "ConstraintSettings",
    "ContactSettings",
    "DataSettings",
    "Estimate",
    "ExcitationSettings",
    "FmuSettings",
    "ForcedPointSettings",
    "ForcedResponseSettings",
    "ForcedValidationSettings",
    "ForcingSettings",
    "FoundationSettings",
    "LearnSettings",
    "LoadHistorySettings",
    "LoadSettings",
    "MaterialSettings",
    "MeshSettings",
    "ModesSettings",
    "PointMassSettings",
    "PreloadSettings",
    "RegionSettings",
    "ReportSettings",
    "RingDownSettings",
    "RingDownStart",
    "SensorSettings",
    "Settings",
    "SpringSettings",
    "Study",
    "StudyError",
    "StudySettings",
    "TieSettings",
    "estimate",
    "load_study",
    "named_points",
    "named_surfaces",
    "study_warnings",
    "surfaces",
    "unknown",
]
