"""The gauges of a case. Each is read in every step and gives one or more columns of `history/gauges.csv`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from coupler.case.types import Length, Name, Number, Point, PositiveLength, PositiveTime, Section, Switch
from coupler.case.units import InSI

Time = Annotated[float, InSI("s", ge=0)]
Edges = tuple[Point, Point]
Window = tuple[Time, Time]

IMPULSE = Field(
    None,
    description="start and end of the time integral: a column of the impulse so far",
    examples=[["0.35 s", "1 s"]],
)
MEAN_OVER = Field(
    None,
    description="time over which to average: columns of the running mean and of its largest size so far, the peak",
    examples=["10 ms"],
)


class LevelGauge(Section):
    """Depth of water over a point: the wet length of the vertical through it."""

    kind: Literal["level"] = Field(description="what it measures: depth of water")
    name: Name = Field(description="column of the history")
    at: tuple[Length, Length] = Field(description="place (x, y)")
    mean_over: PositiveTime | None = MEAN_OVER


class PressureGauge(Section):
    """Pressure of the water at a point."""

    kind: Literal["pressure"] = Field(description="what it measures: pressure")
    name: Name = Field(description="column of the history")
    at: Point = Field(description="point (x, y, z); on the face of a solid or block: just outside of it")
    impulse: Window | None = IMPULSE
    mean_over: PositiveTime | None = MEAN_OVER


class PatchGauge(Section):
    """Mean pressure over a plane patch, as measured by a sensor of that size: a parallelogram (edges) or a disc."""

    kind: Literal["patch"] = Field(description="what it measures: mean pressure over a patch")
    name: Name = Field(description="columns of the history")
    at: Point = Field(description="its centre; on the face of a solid or block: just outside of it")
    edges: Edges | None = Field(
        None,
        description="the two edges of a parallelogram, as vectors",
        examples=[[[0, 0.1, 0], [0, 0, 0.1]]],
    )
    radius: PositiveLength | None = Field(None, description="radius of a disc, with normal")
    normal: tuple[Number, Number, Number] | None = Field(None, description="normal of the disc; any length")
    impulse: Window | None = IMPULSE
    mean_over: PositiveTime | None = MEAN_OVER


class AirGauge(Section):
    """Pressure and volume of a pocket of trapped air; empty while there is none."""

    kind: Literal["air"] = Field(description="what it measures: a pocket of trapped air")
    name: Name = Field(description="columns of the history")
    at: Point = Field(
        description="point (x, y, z); the first pocket at this point is followed from then on; when it is lost, the "
        "next one found here"
    )


class VelocityGauge(Section):
    """Velocity of the water at a point."""

    kind: Literal["velocity"] = Field(description="what it measures: velocity of the water")
    name: Name = Field(description="columns of the history")
    at: Point = Field(description="point (x, y, z)")
    mean_over: PositiveTime | None = MEAN_OVER


class FluxGauge(Section):
    """Volume flow through a plane patch, positive along the cross product of its edges."""

    kind: Literal["flux"] = Field(description="what it measures: flow through a patch")
    name: Name = Field(description="column of the history")
    at: Point = Field(description="centre of the patch")
    edges: Edges = Field(
        description="its two edges, as vectors; first x second points downstream",
        examples=[[[0, 1, 0], [0, 0, 1]]],
    )
    impulse: Window | None = Field(
        None,
        description="start and end of the time integral: a column of the volume that has passed so far",
        examples=[["0 s", "10 s"]],
    )
    mean_over: PositiveTime | None = MEAN_OVER


class VolumeGauge(Section):
    """Volume of the water inside a box."""

    kind: Literal["volume"] = Field(description="what it measures: volume of water")
    name: Name = Field(description="column of the history")
    lower: Point = Field(description="corner with the smallest coordinates")
    upper: Point = Field(description="corner with the largest coordinates")


class ForceGauge(Section):
    """Force of the water on a block, a group, a building or a solid; pressure and wall stress together, or split."""

    kind: Literal["force"] = Field(description="what it measures: force of the water")
    name: Name = Field(description="columns of the history")
    on: Name = Field(
        description="name of a block, a group, a part of the structure (wall, arch, ...) or a solid"
    )
    about: Point | None = Field(
        None, description="point fixed in space about which to give the moment as well; absent: no moment"
    )
    parts: Switch = Field(
        False,
        description="true: further columns for pressure on whole cells, its correction where the surface of the water "
        "passes through their cells (surface), and friction; they add up to the force",
    )
    impulse: Window | None = IMPULSE
    mean_over: PositiveTime | None = MEAN_OVER


class LoadsGauge(Section):
    """All loads on a group of blocks or a solid, split into pressure, friction, contact, joint and weight, in a table
    of their own, history/loads_NAME.csv: force and moment as means over the step, impulses, peaks over mean_over."""

    kind: Literal["loads"] = Field(description="what it measures: loads by their origin")
    name: Name = Field(description="the table is history/loads_NAME.csv")
    on: Name = Field(
        description="name of a block, a group, a part of the structure (wall, arch, ...) or a solid"
    )
    about: Point | None = Field(
        None,
        description="point fixed in space of the moments; absent: centre of mass of all its blocks at the start",
    )
    each_block: Switch = Field(
        False,
        description="true: also a row for each block, in history/loads_NAME_blocks.csv, with moments about "
        "its own centre at the start",
    )
    every: PositiveTime | None = Field(
        None,
        description="time between the rows of each block, which are means over it; absent: a row every step",
        examples=["10 ms"],
    )
    impulse: Window | None = Field(
        None,
        description="start and end of the time integral of the force; absent: the whole run",
        examples=[["0.35 s", "1 s"]],
    )
    mean_over: PositiveTime | None = MEAN_OVER


class ReactionGauge(Section):
    """Force that holds a block in place or to its prescribed motion, as a testing machine measures it."""

    kind: Literal["reaction"] = Field(description="what it measures: force that holds a block")
    name: Name = Field(description="columns of the history")
    on: Name = Field(description="name of a block, a group or a part of the structure (wall, arch, ...)")


class MotionGauge(Section):
    """Centre, velocity, rotation vector and angular velocity of one block."""

    kind: Literal["motion"] = Field(description="what it measures: motion of a block")
    name: Name = Field(description="columns of the history")
    of: Name = Field(description="name of a block")


Gauge = Annotated[
    LevelGauge
    | PressureGauge
    | PatchGauge
    | AirGauge
    | VelocityGauge
    | FluxGauge
    | VolumeGauge
    | ForceGauge
    | LoadsGauge
    | ReactionGauge
    | MotionGauge,
    Field(discriminator="kind"),
]
