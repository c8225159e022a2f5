"""Tables of a study that join bodies: frictional pairs, bonded surfaces, bolts."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from romgen.settings.base import Force, Length, Penalty, PositiveLength, Settings


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
