"""The types of values in the tables of a case file: quantities, names, points and rotations."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from coupler.case.units import InSI

KeyPath = tuple[str | int, ...]
"""Place in a case: names of tables and keys, numbers of entries of lists."""
Problem = tuple[KeyPath, str]
"""A place in a case, and what is wrong there."""

Number = Annotated[float, InSI("")]
Length = Annotated[float, InSI("m")]
PositiveLength = Annotated[float, InSI("m", gt=0)]
Velocity = Annotated[float, InSI("m/s")]
Spin = Annotated[float, InSI("rad/s")]
Density = Annotated[float, InSI("kg/m3", gt=0)]
PositiveTime = Annotated[float, InSI("s", gt=0)]

Point = tuple[Length, Length, Length]
Size = tuple[PositiveLength, PositiveLength, PositiveLength]
VelocityVector = tuple[Velocity, Velocity, Velocity]
SpinVector = tuple[Spin, Spin, Spin]

Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
Wall = Literal["x-", "x+", "y-", "y+"]
Switch = Annotated[bool, Field(strict=True)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=60)]

MATERIAL = (
    "concrete, brick-masonry or timber (presets), or any name to which contact.pair and joints.pair may refer"
)
"""What the material of blocks is, for every table of them."""


class Section(BaseModel):
    """A table of the case file: unknown names, infinities and NaN are refused; nothing changes afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Rotation(Section):
    """A rotation about an axis through the centre, by the right-hand rule."""

    axis: tuple[Number, Number, Number] = Field(description="direction of the axis; any length but zero")
    angle: Annotated[float, InSI("rad")] = Field(description="angle of rotation", examples=["30 deg"])
