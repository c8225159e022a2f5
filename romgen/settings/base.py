"""Common base of all tables of study.toml, and the quantity types that accept units."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator

from romgen.settings.quantities import in_unit


class Settings(BaseModel):
    """Base of all tables: frozen, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_for_a_number(cls, value: object, info: ValidationInfo) -> object:
        """Python takes true for 1; a study that says so has a mistake."""
        field = cls.model_fields[info.field_name or ""]
        if field.annotation is not bool and _holds_truth(value):
            raise ValueError("true and false are no numbers")
        return value


def _holds_truth(value: object) -> bool:
    return isinstance(value, bool) or (isinstance(value, list | tuple) and any(map(_holds_truth, value)))


Length = Annotated[float, BeforeValidator(in_unit("m"))]
PositiveLength = Annotated[float, BeforeValidator(in_unit("m")), Field(gt=0.0)]
Time = Annotated[float, BeforeValidator(in_unit("s")), Field(ge=0.0)]
PositiveTime = Annotated[float, BeforeValidator(in_unit("s")), Field(gt=0.0)]
Acceleration = Annotated[float, BeforeValidator(in_unit("m/s^2"))]
Force = Annotated[float, BeforeValidator(in_unit("N"))]
PositiveFrequency = Annotated[float, BeforeValidator(in_unit("Hz")), Field(gt=0.0)]
Pressure = Annotated[float, BeforeValidator(in_unit("Pa"))]
Modulus = Annotated[float, BeforeValidator(in_unit("Pa")), Field(gt=0.0)]
Density = Annotated[float, BeforeValidator(in_unit("kg/m^3")), Field(gt=0.0)]
Penalty = Annotated[float, BeforeValidator(in_unit("N/m^3")), Field(gt=0.0)]
BedStiffness = Annotated[float, BeforeValidator(in_unit("N/m^3")), Field(ge=0.0)]
SpringStiffness = Annotated[float, BeforeValidator(in_unit("N/m")), Field(ge=0.0)]
Mass = Annotated[float, BeforeValidator(in_unit("kg")), Field(gt=0.0)]
Ratio = Annotated[float, BeforeValidator(in_unit("1"))]
