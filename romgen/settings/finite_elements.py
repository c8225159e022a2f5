"""Tables of a study with a finite-element model: bodies, joints, loads, preload, modes, ring-downs."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal, Self

from pydantic import Field, model_validator

from romgen.settings.base import (
    Density,
    Force,
    Length,
    Modulus,
    PositiveLength,
    PositiveTime,
    Pressure,
    Ratio,
    Settings,
)

Direction = Literal["x", "y", "z"]


class MaterialSettings(Settings):
    """Table [materials.<name>]: isotropic, St. Venant-Kirchhoff (SI)."""

    young_modulus: Modulus
    poisson_ratio: float = Field(gt=-1.0, lt=0.5)
    density: Density


class ArchSettings(Settings):
    """Shallow arch added to a block: y += rise/2 (1 + cos(2 pi x / span)) for abs(x) < span/2."""

    rise: Length
    span: PositiveLength


class BlockSettings(Settings):
    """Table [blocks.<name>]: a structured block, one body; breakpoints in m and cells between them."""

    material: str
    kinematics: Literal["green_lagrange", "linear"] = "green_lagrange"
    element: Literal["hex20", "hex27", "tet10"] = "hex20"
    x: tuple[Length, ...] = Field(min_length=2)
    cells_x: tuple[int, ...]
    y: tuple[Length, ...] = Field(min_length=2)
    cells_y: tuple[int, ...]
    z: tuple[Length, ...] = Field(min_length=2)
    cells_z: tuple[int, ...]
    arch: ArchSettings | None = None

    @model_validator(mode="after")
    def _axes_fit(self) -> Self:
        for axis, points, cells in (
            ("x", self.x, self.cells_x),
            ("y", self.y, self.cells_y),
            ("z", self.z, self.cells_z),
        ):
            if len(cells) != len(points) - 1:
                raise ValueError(f"{axis} has {len(points) - 1} intervals but cells_{axis} has {len(cells)} numbers")
            if min(cells) < 1:
                raise ValueError(f"cells_{axis} must be positive")
            if any(b <= a for a, b in pairwise(points)):
                raise ValueError(f"breakpoints {axis} must increase")
        return self

    def axis(self, name: Direction) -> tuple[tuple[float, ...], tuple[int, ...]]:
        """Return the breakpoints (m) and the cells between them along one axis."""
        axes = {"x": (self.x, self.cells_x), "y": (self.y, self.cells_y), "z": (self.z, self.cells_z)}
        return axes[name]


class ConstraintSettings(Settings):
    """Table [[constraints]]: displacement components held on a face, edge or point; "normal" is a plane of symmetry."""

    surface: str
    directions: tuple[Literal["x", "y", "z", "normal"], ...] = Field(min_length=1)
    displacement: tuple[Length, ...] = ()

    @model_validator(mode="after")
    def _one_value_each(self) -> Self:
        if self.displacement and len(self.displacement) != len(self.directions):
            raise ValueError(f"displacement needs one value for each of {', '.join(self.directions)}")
        return self


class LoadSettings(Settings):
    """Table [[loads]]: one dead load: pressure by its resultant, force, traction, or the acceleration of gravity.

    ``body`` says on which body a point lies where two touch.
    """

    name: str
    surface: str | None = None
    point: tuple[Length, Length, Length] | None = None
    body: str | None = None
    total_force: Force | None = None
    force: tuple[Force, Force, Force] | None = None
    pressure: Pressure | None = None
    traction: tuple[Pressure, Pressure, Pressure] | None = None
    acceleration: tuple[float, float, float] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        kinds = ("total_force", "pressure", "force", "traction", "acceleration")
        given = [kind for kind in kinds if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"needs one of {', '.join(kinds)}; got {', '.join(given) or 'none'}")
        places = [place for place in ("surface", "point") if getattr(self, place) is not None]
        ways_of_kind: dict[str, list[list[str]]] = {"acceleration": [[]], "force": [["surface"], ["point"]]}
        wanted = ways_of_kind.get(given[0], [["surface"]])
        if places not in wanted:
            ways = " or ".join(" and ".join(way) or "no place" for way in wanted)
            raise ValueError(f"{given[0]} goes with {ways}; got {', '.join(places) or 'none'}")
        if self.body is not None and self.point is None:
            raise ValueError("body goes with a point; the name of a surface holds its body")
        return self


class PreloadSettings(Settings):
    """Table [preload]: load-stepped Newton iteration."""

    steps: int = Field(default=4, ge=1)
    tolerance: float = Field(default=1e-8, gt=0.0, lt=1.0)
    max_iterations: int = Field(default=30, ge=1)


class ModesSettings(Settings):
    """Table [modes]: modes of the preloaded tangent and the Rayleigh damping through two of them (from 1)."""

    count: int = Field(default=6, ge=1)
    damping_ratio: tuple[Ratio, Ratio] = (0.004, 0.004)
    rayleigh_modes: tuple[int, int] = (1, 2)


class SensorSettings(Settings):
    """Table [sensors.<name>]: one displacement component at one material point, of ``body`` where two touch."""

    point: tuple[Length, Length, Length]
    direction: Direction
    body: str | None = None


class BaseAccelerationSettings(Settings):
    """Table [base_acceleration]: rigid translation of all constrained faces, f = -M b a(t)."""

    direction: Direction


class ExcitationSettings(Settings):
    """Table [excitations.<name>]: a force in N along ``direction`` at a point or spread over a face, edge or region.

    Without a direction it is a pressure in Pa against the normals of a face. ``body`` says on which body a point lies
    where two touch.
    """

    surface: str | None = None
    point: tuple[Length, Length, Length] | None = None
    direction: tuple[float, float, float] | None = None
    body: str | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.surface is None) == (self.point is None):
            raise ValueError("needs either surface or point")
        if self.point is not None and self.direction is None:
            raise ValueError("a force at a point needs a direction, such as [0.0, 1.0, 0.0]")
        if self.direction is not None and not any(self.direction):
            raise ValueError("direction is zero")
        if self.body is not None and self.point is None:
            raise ValueError("body goes with a point; the name of a surface holds its body")
        return self

    @property
    def unit(self) -> str:
        """SI unit of the load input."""
        return "Pa" if self.direction is None else "N"


class RingDownStart(Settings):
    """Table [[ringdowns.training]] or [[ringdowns.validation]]: peak displacement of each master mode, m."""

    name: str
    amplitudes: tuple[Length, ...] = Field(min_length=1)


class RingDownSettings(Settings):
    """Table [ringdowns]: free decays, all marching together."""

    time_step: PositiveTime
    duration: PositiveTime
    spectral_radius: float = Field(default=0.9, ge=0.0, le=1.0)
    tolerance: float = Field(default=1e-4, gt=0.0, lt=1.0)
    scheme: Literal["generalised_alpha", "central_difference"] = "generalised_alpha"
    method: Literal["anderson", "newton"] = "anderson"
    max_iterations: int = Field(default=60, ge=1)
    refactor_above: int = Field(default=15, ge=0)
    max_cutbacks: int = Field(default=6, ge=0, le=20)
    max_doublings: int = Field(default=0, ge=0, le=10)
    error_tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)
    explicit_step: PositiveTime | None = None
    snapshot_stride: int = Field(default=10, ge=1)
    segment_steps: int = Field(default=250, ge=1)
    start: Literal["modal", "static"] = "static"
    training: tuple[RingDownStart, ...] = Field(min_length=1)
    validation: tuple[RingDownStart, ...] = ()

    @property
    def steps(self) -> int:
        """Number of time steps of each ring-down."""
        return round(self.duration / self.time_step)

    @property
    def starts(self) -> tuple[RingDownStart, ...]:
        """Training starts, then validation starts: the order of the columns of the batch."""
        return self.training + self.validation
