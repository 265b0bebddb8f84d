"""The section [verdict]: the rules by which a structure is judged to stand, to be damaged, or to have collapsed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from coupler.case.types import Name, Section
from coupler.case.units import InSI


class Verdict(Section):
    """When a structure counts as damaged or collapsed, reported at the end of every run with a structure."""

    on: tuple[Name, ...] = Field(
        (),
        description="what is judged: names of blocks, groups, walls and floors or tables of the structure; absent: all "
        "blocks with joints at the start, or, where none is, all that can move",
        examples=[["house"]],
    )
    moved: Annotated[float, InSI("", gt=0, le=10)] = Field(
        0.1, description="a block has left its place when its centre has moved by this share of its thickness"
    )
    damaged_joints: Annotated[float, InSI("", ge=0, le=1)] = Field(
        0.0,
        description="damaged from more than this share of the joined area failed, in joints that broke or tore in "
        "part, or a block out of its place",
    )
    collapsed_weight: Annotated[float, InSI("", gt=0, le=1)] = Field(
        0.2,
        description="collapsed when this share of the weight has left its place and stays out of it: blocks that came "
        "back, and those that rock so that their weight turns them back, do not count",
    )
    collapsed_joints: Annotated[float, InSI("", gt=0, le=1)] | None = Field(
        None, description="collapsed also when this share of the joined area is broken; absent: not by joints"
    )
    hit_speed: Annotated[float, InSI("m/s", gt=0)] | None = Field(
        None,
        description="debris hits what it loses at least this speed to within a step, or within two that divide a "
        "blow; absent: the speed of a fall from a hundredth of its thickness, 0.7 m/s for a container of 2.6 m",
    )
