"""Tables from learning to the report: [learn], [forced_response], [fmu], [report], [acceptance]."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from romgen.settings.base import Acceleration, PositiveFrequency, PositiveTime, Settings, Time


class LearnSettings(Settings):
    """Table [learn]: the manifold and its normal form."""

    master_modes: tuple[int, ...] = (1, 2)
    internal_resonance: tuple[int, ...] | Literal["auto", "gap"] = "auto"
    order: int | Literal["auto"] = "auto"
    method: Literal["auto", "direct", "refined"] = "auto"
    geometry_order: int | None = Field(default=None, ge=1, le=9)
    ridge: float = Field(default=1e-8, ge=0.0)
    linear_part: Literal["modes", "fitted"] = "modes"
    start_time: Time = 0.0


class ForcedResponseSettings(Settings):
    """Table [forced_response]: levels of one load input and where the answer is observed."""

    input: str = "base_acceleration"
    levels: tuple[float, ...] = ()
    sensor: str | None = None
    measure: Literal["max", "sqrt2_rms"] = "sqrt2_rms"
    frequency_range_hz: tuple[PositiveFrequency, PositiveFrequency] | None = None


class ForcedValidationSettings(Settings):
    """Table [forced_validation]: points of the frequency response that the finite-element model computes too.

    Per level one point for each share of the largest stable amplitude; both models run for ``duration``.
    """

    shares: tuple[Annotated[float, Field(gt=0.0, le=1.0)], ...] = Field(default=(0.5, 0.9), min_length=1)
    duration: PositiveTime = 0.3


class LoadHistorySettings(Settings):
    """Table [load_histories.<name>]: a function of time on one load input that both models follow from rest.

    Samples (s, unit of the input) from ``times`` and ``values`` or a CSV ``file`` of two columns, times ``scale``;
    linear between them, 0 outside.
    """

    input: str
    file: Path | None = None
    times: tuple[Time, ...] = ()
    values: tuple[float, ...] = ()
    scale: float = 1.0
    duration: PositiveTime | None = None

    @field_validator("file")
    @classmethod
    def _beside_the_study(cls, file: Path | None, info: ValidationInfo) -> Path | None:
        return None if file is None else (Path((info.context or {}).get("folder", ".")) / file).resolve()

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (not self.times):
            raise ValueError("needs either file, or times and values")
        if len(self.times) != len(self.values):
            raise ValueError(f"has {len(self.times)} times but {len(self.values)} values")
        return self


class FmuSettings(Settings):
    """Table [fmu]: what the exported unit shows and on which platforms it runs."""

    sensors: tuple[str, ...] | None = None
    platforms: tuple[str, ...] = ("host",)
    step_size: PositiveTime = 1e-4
    absolute: bool = False
    start: Literal["state", "sensors"] = "state"
    coefficients: Literal["auto", "embedded", "file"] = "auto"
    fmi3: bool = False
    pythonfmu: bool = True
    input_range: dict[str, tuple[Acceleration, Acceleration]] = Field(default_factory=dict)
    icon: Path | None = None

    @field_validator("icon")
    @classmethod
    def _beside_the_study(cls, icon: Path | None, info: ValidationInfo) -> Path | None:
        return None if icon is None else (Path((info.context or {}).get("folder", ".")) / icon).resolve()


class ReportSettings(Settings):
    """Table [report]: the headline of report.html, by default the name of the study; fields for ParaView or not."""

    title: str | None = None
    vtu: bool = True


class AcceptanceSettings(Settings):
    """Table [acceptance]: limits that `romgen validate` enforces (exit code 4) and the report states."""

    nmte_percent: float = Field(default=10.0, gt=0.0)
    fmu_relative: float = Field(default=1e-9, gt=0.0)
    preload_percent: float = Field(default=0.1, gt=0.0)
    ledger_percent: float = Field(default=0.5, gt=0.0)
    forced_percent: float = Field(default=10.0, gt=0.0)
