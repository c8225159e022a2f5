"""Table [data]: trajectories from another code or from the lab instead of a finite-element model."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from romgen.settings.base import Settings


class DataSettings(Settings):
    """Table [data]: files (relative to the study), the sensors in their rows, and who trains and who validates."""

    files: tuple[Path, ...] = Field(min_length=1)
    sensors: tuple[str, ...] = Field(min_length=1)
    unit: str = "m"
    training: tuple[int | str, ...] = Field(min_length=1)
    validation: tuple[int | str, ...] = ()
    zero: Literal["recorded", "rest"] = "recorded"

    @field_validator("files")
    @classmethod
    def _beside_the_study(cls, files: tuple[Path, ...], info: ValidationInfo) -> tuple[Path, ...]:
        folder = Path((info.context or {}).get("folder", "."))
        return tuple((folder / path).resolve() for path in files)
