"""Tables of bodies that come from mesh files, and of named regions on any body."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from romgen.settings.base import Length, Settings
from romgen.settings.quantities import UNITS

Range = tuple[Length, Length]


class MeshSettings(Settings):
    """Table [meshes.<name>]: a body from a .msh, .inp or .vtu file, or from a geometry that Gmsh meshes."""

    file: Path
    material: str
    kinematics: Literal["green_lagrange", "linear"] = "green_lagrange"
    unit: Literal["m", "mm", "um", "cm", "in"] = "m"
    group: str | None = None
    raise_order: bool = False
    mesh_size: float | None = Field(default=None, gt=0.0)

    @field_validator("file")
    @classmethod
    def _beside_the_study(cls, file: Path, info: ValidationInfo) -> Path:
        return (Path((info.context or {}).get("folder", ".")) / file).resolve()

    @property
    def unit_m(self) -> float:
        """Length of one unit of the file, m."""
        return UNITS["m"][self.unit]


class RegionSettings(Settings):
    """Table [regions.<name>]: nodes of a body within ranges of coordinates, and the whole outer faces of them."""

    body: str
    x: Range | None = None
    y: Range | None = None
    z: Range | None = None

    @model_validator(mode="after")
    def _ranges_are_in_order(self) -> Self:
        ranges = [limits for limits in (self.x, self.y, self.z) if limits is not None]
        if not ranges:
            raise ValueError("needs a range for at least one of x, y, z, such as x = [0.0, 0.01]")
        if any(low > high for low, high in ranges):
            raise ValueError("ranges must go from the smaller to the larger coordinate")
        return self
