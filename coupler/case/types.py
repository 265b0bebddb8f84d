"""What the tables of a case file are made of: quantities, names, points and turns."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from coupler.case.units import quantity

Number = quantity("")
Length = quantity("m")
PositiveLength = quantity("m", gt=0)
Velocity = quantity("m/s")
Spin = quantity("rad/s")
Density = quantity("kg/m3", gt=0)
PositiveTime = quantity("s", gt=0)

Point = tuple[Length, Length, Length]
Size = tuple[PositiveLength, PositiveLength, PositiveLength]
VelocityVector = tuple[Velocity, Velocity, Velocity]
SpinVector = tuple[Spin, Spin, Spin]

Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
Wall = Literal["x-", "x+", "y-", "y+"]
Switch = Annotated[bool, Field(strict=True)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=60)]


class Section(BaseModel):
    """A table of the case file: unknown names, infinities and NaN are refused; nothing changes afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Rotation(Section):
    """A turn about an axis through the centre, by the right-hand rule."""

    axis: tuple[Number, Number, Number] = Field(description="direction of the axis; any length but zero")
    angle: quantity("rad") = Field(description="angle of the turn", examples=["30 deg"])
