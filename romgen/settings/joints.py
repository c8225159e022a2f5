"""Tables of a study that join bodies to each other and to the ground: pairs, ties, bolts, springs, beds, masses."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from romgen.settings.base import BedStiffness, Force, Length, Mass, Penalty, PositiveLength, Settings, SpringStiffness


class ContactSettings(Settings):
    """Table [contacts.<name>]: a frictional pair of faces; penalties default to ``stiffness`` E / h."""

    slave: str
    master: str
    friction: float = Field(ge=0.0)
    normal_penalty: Penalty | None = None
    tangential_penalty: Penalty | None = None
    stiffness: float = Field(default=1.0, gt=0.0)
    reach: PositiveLength | None = None


class TieSettings(Settings):
    """Table [ties.<name>]: two faces bonded for good by a penalty of ``stiffness`` E / h."""

    slave: str
    master: str
    penalty: Penalty | None = None
    stiffness: float = Field(default=100.0, gt=0.0)
    reach: PositiveLength | None = None


class BoltSettings(Settings):
    """Table [bolts.<name>]: a body whose shank is cut at ``section`` along ``axis`` and tightened to ``force``."""

    body: str
    force: Force = Field(gt=0.0)
    axis: Literal["x", "y", "z"] = "y"
    section: Length | None = None
    stiffness: float = Field(default=1000.0, gt=0.0)


class SpringSettings(Settings):
    """Table [springs.<name>]: k_x, k_y, k_z between a point and the ground, or a second point ``to``.

    ``body`` and ``to_body`` say on which bodies the points lie where two touch.
    """

    point: tuple[Length, Length, Length]
    stiffness: tuple[SpringStiffness, SpringStiffness, SpringStiffness]
    to: tuple[Length, Length, Length] | None = None
    body: str | None = None
    to_body: str | None = None


class FoundationSettings(Settings):
    """Table [foundations.<name>]: an elastic bed under a face; ``normal`` defaults to 1000 E / h, which holds it."""

    surface: str
    normal: BedStiffness | None = None
    tangential: BedStiffness = 0.0


class PointMassSettings(Settings):
    """Table [point_masses.<name>]: a mass that moves with a material point, of ``body`` where two touch."""

    point: tuple[Length, Length, Length]
    mass: Mass
    body: str | None = None
