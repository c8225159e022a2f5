"""Table [forcing.<name>]: a load input of recorded data, known by measured points or by its participation."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from romgen.settings.base import PositiveFrequency, PositiveLength, Settings


class ForcedPointSettings(Settings):
    """Entry of [forcing.<name>] points: the steady answer of one sensor to ``level`` cos(2 pi frequency_hz t).

    With ``peak``, or without a frequency, it is the peak of the frequency response at that level.
    """

    level: float = Field(gt=0.0)
    sensor: str
    amplitude: PositiveLength
    frequency_hz: PositiveFrequency | None = None
    peak: bool = False
    measure: Literal["max", "sqrt2_rms"] | None = None
    mode: int | None = Field(default=None, ge=1)

    @model_validator(mode="after")
    def _mode_of_a_peak(self) -> Self:
        if self.frequency_hz is not None and self.mode is not None:
            raise ValueError("mode says whose peak a point without frequency_hz is; keep one of them")
        return self


class ForcingSettings(Settings):
    """Table [forcing.<name>]: a load input of recorded data, m/s2 for base_acceleration and N for any other name."""

    points: tuple[ForcedPointSettings, ...] = ()
    modes: tuple[Annotated[int, Field(ge=1)], ...] = ()
    sign: Literal[-1, 1] | None = None
    participation: dict[str, tuple[float, ...]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if bool(self.points) == bool(self.participation):
            raise ValueError("needs either points (measured) or participation (known)")
        if self.participation and (self.modes or self.sign is not None):
            raise ValueError("modes and sign go with points; participation has one number with its sign per mode")
        if len(set(self.modes)) < len(self.modes):
            raise ValueError(f"modes must differ; got {list(self.modes)}")
        if self.points and len(self.points) < len(self.modes):
            raise ValueError(f"needs at least one point per loaded mode; got {len(self.points)} for {len(self.modes)}")
        return self
