"""The section [water]: fluid, walls, initial fills, inflows and seas, and fixed solids."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from coupler.case.types import (
    MATERIAL,
    Density,
    Length,
    Name,
    Number,
    Point,
    PositiveLength,
    PositiveTime,
    Rotation,
    Section,
    Size,
    Switch,
    Velocity,
    Wall,
)
from coupler.case.units import InSI

File = Annotated[str, Field(min_length=1)]


class Fill(Section):
    """A box of water at the start, full unless slope or surface is given; solids and blocks in it displace the
    water."""

    lower: Point = Field(description="corner with the smallest coordinates", examples=[[0, 0, 0]])
    upper: Point = Field(description="corner with the largest coordinates", examples=[[20, 24, 10]])
    velocity: tuple[Velocity, Velocity, Velocity] = Field(
        (0.0, 0.0, 0.0), description="velocity of its water at the start", examples=[[3, 0, 0]]
    )
    slope: tuple[Number, Number] | None = Field(
        None,
        description="slope of its surface along x and y; in the middle of the box the surface "
        "is at upper[2]. Absent: level",
        examples=[[0.02, 0]],
    )
    surface: File | None = Field(
        None,
        description="instead: heights z [m] of its surface in coordinates of the tank, for instance a wave that has "
        "entered, or a mode of a basin: rows of x, y, z (.csv) or a raster as terrain.path, from the directory of the "
        "case. The water fills the box up to them; upper[2] is the highest that they may be",
        examples=["start.csv"],
    )


ABSORBS = Field(
    False,
    description="true: outgoing waves leave, long ones wholly, short and oblique ones in part; false: they are "
    "reflected as by a moving wall",
)


class SteadyInflow(Section):
    """A stream of constant level and velocity."""

    kind: Literal["steady"] = Field(description="kind of inflow: a steady stream")
    side: Wall = Field(description="the side of the tank, across its whole width")
    level: Length = Field(description="height z of its surface")
    velocity: Velocity = Field(
        description="velocity into the tank, the same over the depth; where only the depth of a surge is known, take "
        'kind = "bore"'
    )
    absorbs: Switch = ABSORBS
    keeps: Literal["level", "discharge"] = Field(
        "level",
        description="what stays as given where the water behind the side backs up or falls away, level or discharge "
        "(level above the bed times velocity); with discharge the level follows the water behind it, as at the "
        "upstream end of a river",
    )


class RecordInflow(Section):
    """Level and velocity from a table or from a gauge of another model, linear between its times."""

    kind: Literal["record"] = Field(description="kind of inflow: a record")
    side: Wall = Field(description="the side of the tank, across its whole width")
    path: File = Field(
        description="CSV with the columns time [s], level (z) [m], velocity (into the tank) [m/s]; with a column "
        "along (place on the side, y or x) [m] a line for each time and place, and perhaps sideways (velocity along "
        "the side); lines that begin with # are skipped. Or a gauge of GeoClaw (gaugeNNNNN.txt) or Thetis "
        "(diagnostic_*.hdf5), whose velocities are along the axes of the terrain file. From the directory of the case",
        examples=["wave.csv"],
    )
    gauge: str | None = Field(None, description="of a file of Thetis with several detectors: its name")
    start: Annotated[float, InSI("s")] = Field(0.0, description="time of the record at which the run begins")
    zero: Length = Field(0.0, description="level of the record that is z = 0")
    velocity: Literal["given", "long-wave"] = Field(
        "given",
        description="source of the velocity: the record, or, for a record of levels alone, a long wave that enters "
        "still water, 2 (sqrt(g h) - sqrt(g d)) over the mean bed along the side",
    )
    still: Length | None = Field(
        None,
        description="with long-wave: height z of the still water; absent: the level at which the run begins",
    )
    absorbs: Switch = ABSORBS


class BoreInflow(Section):
    """A bore: the water behind its front is deeper and moves, the water ahead is at rest; or a surge onto dry ground,
    as after an instantaneous dam break."""

    kind: Literal["bore"] = Field(description="kind of inflow: a bore")
    side: Wall = Field(description="the side of the tank, across its whole width")
    ahead: Length | None = Field(
        None,
        description="height z of the still water; absent: the ground is dry, and water of depth h at the side enters "
        "at sqrt(g h)",
    )
    absorbs: Switch = ABSORBS
    level: Length = Field(description="height z of the surface behind the front")


class SolitaryInflow(Section):
    """One solitary wave."""

    kind: Literal["solitary"] = Field(description="kind of inflow: a solitary wave")
    side: Wall = Field(description="the side of the tank, across its whole width")
    level: Length = Field(description="height z of the still water")
    height: PositiveLength = Field(description="height of the crest above the still water")
    crest: PositiveTime = Field(description="time at which the crest passes the side")
    theory: Literal["goring", "grimshaw"] = Field(
        "grimshaw",
        description="first order, with a uniform velocity that carries the volume of the wave, or third order",
    )
    absorbs: Switch = ABSORBS


class NWaveInflow(Section):
    """One N-wave: a trough and a crest of one height, a model of a tsunami at the coast."""

    kind: Literal["n-wave"] = Field(description="kind of inflow: an N-wave")
    side: Wall = Field(description="the side of the tank, across its whole width")
    level: Length = Field(description="height z of the still water")
    height: PositiveLength = Field(description="height of the crest above, and depth of the trough below it")
    middle: PositiveTime = Field(
        description="time at which the middle between trough and crest passes the side"
    )
    leading: Literal["depression", "elevation"] = Field("depression", description="what comes first")
    absorbs: Switch = ABSORBS


Inflow = Annotated[
    SteadyInflow | RecordInflow | BoreInflow | SolitaryInflow | NWaveInflow, Field(discriminator="kind")
]


class Tide(Section):
    """Slow change of the level of a sea: a harmonic, or a table."""

    amplitude: PositiveLength | None = Field(None, description="half of the height from low to high water")
    period: PositiveTime | None = Field(
        None, description="from one high water to the next", examples=["12.42 h"]
    )
    high: Annotated[float, InSI("s")] = Field(0.0, description="time of a high water")
    path: File | None = Field(
        None,
        description="instead: CSV with the columns time [s] and level (z) [m], from the directory of the case",
        examples=["tide.csv"],
    )


class Sea(Section):
    """A side that borders on a sea of a given level; water enters and leaves freely."""

    side: Wall = Field(description="the side of the tank, across its whole width")
    level: Length = Field(
        description="height z of the still sea; with a tide its mean, with one from a table that at the start"
    )
    tide: Tide | None = Field(None, description="change of the level in time")
    absorbs: Switch = Field(
        False,
        description="true: waves leave, long ones wholly, short and oblique ones in part; false: its level is fixed, "
        "so that waves are reflected with the opposite sign",
    )


class Vent(Section):
    """An orifice through which air passes between a pocket and the open air; water does not pass."""

    at: Point = Field(
        description="a point in the air of the pocket, a cell away from walls; with block: its initial position"
    )
    area: Annotated[float, InSI("m2", gt=0)] = Field(description="area of the opening", examples=["10 cm2"])
    discharge: Annotated[float, InSI("", gt=0, le=1)] = Field(
        0.6, description="discharge coefficient: cross-section of the jet over the area"
    )
    block: Name | None = Field(
        None, description="block that the orifice moves with; absent: it is fixed in space"
    )


class Air(Section):
    """The air above the water and enclosed by it. Absent: all air is open."""

    model: Literal["open", "trapped"] = Field(
        "open",
        description="open: all air has the pressure of the atmosphere; trapped: air that reaches no open side of the "
        "tank, nor one with a sea above its level, is compressed and acts on water, blocks and solids by its pressure",
    )
    gamma: Annotated[float, InSI("", ge=1, le=1.4)] = Field(
        1.4,
        description="exponent of p V^gamma of trapped air: 1.4 adiabatic, 1 isothermal",
    )
    atmospheric: Annotated[float, InSI("Pa", gt=0)] = Field(
        101_325.0, description="absolute pressure of the open air"
    )
    smallest: Annotated[float, InSI("", ge=1)] = Field(
        8.0,
        description="smallest volume of a pocket at the pressure of the open air, in bricks of the mesh (cubes of "
        "edge tank.cell); smaller bubbles become open air (counted in history/air.csv). The volume of one of 8 bricks "
        "is known to 0.1 %, its pressure to 0.1 kPa, of one of 3 to 1 % and 1.2 kPa",
    )
    vent: tuple[Vent, ...] = Field((), description="orifices of pockets")


class Water(Section):
    """The water. Absent: no water, and nothing of the flow solver is loaded."""

    density: Density = Field(1000.0, description="mass per volume")
    viscosity: Annotated[float, InSI("Pa s", ge=0)] = Field(
        0.0,
        description="dynamic viscosity; 0: the term is left out",
        examples=["1 mPa s"],
    )
    walls: Literal["slip", "no-slip", "friction"] = Field(
        "slip",
        description="wall condition on closed sides, solids and blocks: free slip, no slip (needs viscosity), or "
        "friction by roughness or manning; sides in tank.smooth are excepted",
    )
    roughness: PositiveLength | None = Field(
        None, description="sand roughness k_s of all walls, for friction by the log law", examples=["3 mm"]
    )
    manning: Annotated[float, InSI("", gt=0, le=1)] | None = Field(
        None,
        description="Manning's n [s/m^(1/3)] of the floor and of faces that point upwards, for friction of a bed",
        examples=[0.025],
    )
    advection: Literal["semi-lagrangian", "supg"] = Field(
        "semi-lagrangian",
        description="transport of velocity and surface: along the paths of the flow, or by stabilised finite "
        "elements, the reference, whose steps cost four to seven times as much",
    )
    theta: Annotated[float, InSI("", ge=0.5, le=1)] = Field(
        0.6, description="weight of the new pressure in the projection; 0.5 has the least damping, 1 the most"
    )
    suction: Literal["bounded", "unlimited"] = Field(
        "bounded",
        description="lower bound of the pressure: that of the air where air can reach the water, elsewhere "
        "vapour_pressure, at which the water separates; or no bound, for comparison",
    )
    vapour_pressure: Annotated[float, InSI("Pa", lt=0)] = Field(
        -98e3, description="pressure of the vapour of the water, relative to the air", examples=["-98 kPa"]
    )
    air: Air = Field(default_factory=Air, description="model of the air")
    covers: Literal["single", "multiple"] = Field(
        "single",
        description="one set of unknowns per node, or one per part of the water that a thin wall separates",
    )
    openings: Literal["all", "wide", "edges"] = Field(
        "all",
        description="with multiple covers, what counts as an opening of a thin wall: any, which acts as one cell wide "
        "at least; only those about a cell wide and more, for right edges and added mass of thin plates (wide); or the "
        "same beside free edges, and any where two faces, or a face and a side of the tank, lie less than a cell "
        "apart, so that slits and films under blocks stay open (edges)",
    )
    cracks: Literal["open", "closed", "slit"] = Field(
        "open",
        description="broken joints of walls thinner than two cells, while narrower than a quarter of a cell: openings "
        "as the mesh sees them (one cell wide at least), closed, or closed with the flow through them lumped",
    )
    fill: tuple[Fill, ...] = Field(
        (),
        description="the water at the start; at least one box, or an inflow or a sea, "
        "which then begin with a strip of water one cell wide",
    )
    inflow: tuple[Inflow, ...] = Field((), description="sides through which water enters")
    sea: tuple[Sea, ...] = Field((), description="sides that border on a sea")


class Solid(Section):
    """A fixed body in the water, for instance an obstacle: a box (centre, size), the hull of points (vertices), or the
    convex bodies of a file (path). It receives loads and never moves. In a case with a structure it is one of its
    blocks, held in place: blocks hit it, rest on it and, with joints, are joined to it where their faces touch."""

    name: Name = Field("solid", description="for gauges and results")
    centre: Point | None = Field(None, description="centre of a box")
    size: Size | None = Field(None, description="edges of the box along its own axes")
    rotation: Rotation | None = Field(None, description="rotation of the box; absent: aligned with the axes")
    vertices: tuple[Point, ...] | None = Field(
        None,
        description="points whose convex hull is the body",
        examples=[[[5, 0, 0], [9, 0, 0], [9, 0, 2], [5, 4, 0], [9, 4, 0], [9, 4, 2]]],
    )
    path: File | None = Field(
        None,
        description="mesh of volume cells or closed convex surfaces that meshio reads, from the directory of the case",
        examples=["pier.stl"],
    )
    scale: PositiveLength = Field(1.0, description="length of one unit of the file", examples=["1 mm"])
    offset: Point = Field((0.0, 0.0, 0.0), description="added to all places of the file, after the scale")
    weld: PositiveLength | None = Field(
        None, description="corners of the file closer than this are merged; absent: found from its edges"
    )
    material: Name = Field("solid", description=MATERIAL)
    density: Density | None = Field(
        None,
        description="density, for its weight among the loads alone, since it never moves; absent: that of its material "
        "where that is a preset, else 2400 kg/m3, whatever the blocks have",
    )
