"""The tables of study.toml as frozen, strict records."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class Settings(BaseModel):
    """Base of all tables: frozen, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class LearnSettings(Settings):
    """Table [learn]: the manifold and its normal form."""

    master_modes: tuple[int, ...] = (1, 2)
    internal_resonance: tuple[int, ...] | Literal["auto"] = "auto"
    order: int | Literal["auto"] = "auto"
    geometry_order: int | None = Field(default=None, ge=1, le=9)
    ridge: float = Field(default=1e-8, ge=0.0)
    start_time: float = Field(default=0.0, ge=0.0)


class ForcedResponseSettings(Settings):
    """Table [forced_response]: levels of one load input and where the answer is observed."""

    input: str = "base_acceleration"
    levels: tuple[float, ...] = ()
    sensor: str | None = None
    measure: Literal["max", "sqrt2_rms"] = "sqrt2_rms"
    frequency_range_hz: tuple[float, float] | None = None


class FmuSettings(Settings):
    """Table [fmu]: what the exported unit shows and on which platforms it runs."""

    sensors: tuple[str, ...] | None = None
    platforms: tuple[str, ...] = ("host",)
    step_size: float = Field(default=1e-4, gt=0.0)
    pythonfmu: bool = True
