"""The case: what a `case.toml` may say, in SI, with a description and a unit for every name.

A section that is absent switches its module off (`modules`). Unknown names are refused. The page
`docs/case_file.md` and `surgebreak explain` are made from this file alone.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from coupler.units import quantity

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


class About(Section):
    """What the case is, and what holds everywhere in it."""

    title: str = Field(description="one line for people")
    description: str = Field("", description="what happens, where it comes from, what to look at")
    gravity: quantity("m/s2", ge=0) = Field(
        9.81, description="acceleration of gravity, along -z; z points up"
    )


class Time(Section):
    """How long, in which steps, and how often results are written."""

    end: PositiveTime = Field(description="the run ends at this time", examples=["4 s"])
    step_max: PositiveTime = Field(0.05, description="largest step of the coupled scheme")
    cfl: quantity("", gt=0, le=10) = Field(
        1.0, description="cells that the fastest water may cross in one step; sets the step up to step_max"
    )
    output_every: PositiveTime | None = Field(
        None, description="time between two written states; absent: a hundredth of the end time"
    )


class Tank(Section):
    """The box in which water may be: a fixed mesh of tetrahedra. Closed sides are walls for blocks too."""

    lower: Point = Field(description="corner with the smallest coordinates", examples=[[0, 0, 0]])
    upper: Point = Field(description="corner with the largest coordinates", examples=[[60, 24, 16]])
    cell: PositiveLength = Field(
        description="wanted edge of the mesh cells; changed so that a whole number fits each side",
        examples=["1 m"],
    )
    open: tuple[Side, ...] = Field(
        ("z+",), description="sides through which air and water may leave; the others are smooth walls"
    )


class Fill(Section):
    """A box full of water at the start; solids and blocks in it displace the water."""

    lower: Point = Field(description="corner with the smallest coordinates", examples=[[0, 0, 0]])
    upper: Point = Field(description="corner with the largest coordinates", examples=[[20, 24, 10]])


class Water(Section):
    """The water. Absent: no water, and nothing of the flow solver is loaded."""

    density: Density = Field(1000.0, description="mass per volume")
    theta: quantity("", ge=0.5, le=1) = Field(
        0.6, description="weight of the new pressure in the projection; 0.5 damps least, 1 most"
    )
    covers: Literal["single", "multiple"] = Field(
        "single",
        description="one set of unknowns per node, or one per part of the water that a thin wall separates",
    )
    fill: tuple[Fill, ...] = Field((), description="where the water stands at the start; at least one box")


class Rotation(Section):
    """A turn about an axis through the centre, by the right-hand rule."""

    axis: tuple[Number, Number, Number] = Field(description="direction of the axis; any length but zero")
    angle: quantity("rad") = Field(description="angle of the turn", examples=["30 deg"])


class Solid(Section):
    """A fixed box in the water, for instance an obstacle; it carries forces but never moves."""

    name: Name = Field("solid", description="for gauges and results")
    centre: Point = Field(description="centre of the box")
    size: Size = Field(description="edges of the box along its own axes")
    rotation: Rotation | None = Field(None, description="turn of the box; absent: along the axes")


class Block(Section):
    """One rigid block that moves: a box (size) or a convex polyhedron (vertices)."""

    name: Name = Field(description="for joints, gauges, motions and results; one block a name")
    centre: Point | None = Field(
        None,
        description="centre of mass at the start; a polyhedron without it stands where its vertices are",
    )
    size: Size | None = Field(None, description="edges of the box along its own axes")
    vertices: Annotated[tuple[Point, ...], Field(min_length=4)] | None = Field(
        None,
        description="corners of a convex polyhedron in any order, its faces are found; with a centre from any origin",
        examples=[[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]],
    )
    rotation: Rotation | None = Field(
        None, description="turn about the centre of mass; absent: along the axes"
    )
    velocity: VelocityVector = Field((0.0, 0.0, 0.0), description="velocity of the centre at the start")
    spin: SpinVector = Field((0.0, 0.0, 0.0), description="angular velocity at the start, world axes")
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")
    fixed: Switch = Field(False, description="true: held in place for the whole run")
    group: Name | None = Field(None, description="a name shared by blocks; gauges can add up a group")


class Opening(Section):
    """A door or a window: a rectangle without blocks in one wall of a building."""

    wall: Wall = Field(description="the wall, by the side on which it stands")
    lower: tuple[Length, Length] = Field(
        description="its corner: distance along the wall from the wall's end with the smaller coordinate, "
        "and height above the foot of the building",
        examples=[[4, 0]],
    )
    size: tuple[PositiveLength, PositiveLength] = Field(description="width and height", examples=[[2, 3]])


class Building(Section):
    """Four walls of blocks, floors between the storeys and a roof."""

    name: Name = Field("building", description="the group of all its blocks")
    lower: Point = Field(description="lowest corner of the foot, outside of the walls", examples=[[30, 7, 0]])
    size: Size = Field(description="outside length, depth and height, roof included", examples=[[20, 10, 12]])
    wall_thickness: PositiveLength = Field(description="thickness of the walls", examples=["1 m"])
    block: tuple[PositiveLength, PositiveLength] = Field(
        description="wanted length and height of the blocks; changed so that whole numbers fit",
        examples=[["2 m", "2 m"]],
    )
    storeys: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        1, description="number of storeys of equal height, with a floor between two of them"
    )
    floor_thickness: PositiveLength | None = Field(
        None, description="thickness of floors and roof; absent: wall_thickness"
    )
    roof: Switch = Field(True, description="false: open at the top")
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")
    opening: tuple[Opening, ...] = Field((), description="doors and windows")


class MasonryWall(Section):
    """A straight wall or pier: a box divided into equal blocks."""

    name: Name = Field(
        "wall", description="the group of all its blocks, which are called NAME-0-0-0 and so on"
    )
    lower: Point = Field(description="corner with the smallest coordinates")
    size: Size = Field(description="outside edges")
    block: Size = Field(description="wanted edges of the blocks; changed so that whole numbers fit")
    bond: Literal["stack", "running"] = Field(
        "stack",
        description="stack: joints in line; running: every other course and wythe shifted by half a block",
    )
    along: Literal["x", "y"] | None = Field(
        None, description="length of the wall, along which a running bond is shifted; absent: its longer side"
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")


class Column(Section):
    """Equal drums on one another: boxes (size) or prisms of many sides (radius)."""

    name: Name = Field("column", description="the group of its drums, NAME-0 the lowest")
    foot: Point = Field(description="middle of its underside")
    height: PositiveLength = Field(description="of the whole column")
    drums: Annotated[int, Field(strict=True, ge=1, le=1000)] = Field(description="number of drums")
    size: tuple[PositiveLength, PositiveLength] | None = Field(
        None, description="edges of boxes along x and y"
    )
    radius: PositiveLength | None = Field(
        None, description="of the circle through the corners of round drums, at the foot"
    )
    top_radius: PositiveLength | None = Field(
        None, description="the same at the top, of a column that tapers; absent: radius"
    )
    sides: Annotated[int, Field(strict=True, ge=3, le=64)] = Field(12, description="sides of a round drum")
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")


class Arch(Section):
    """Wedge-shaped blocks (voussoirs) on a circle; their joints point to its centre."""

    name: Name = Field("arch", description="the group of its blocks; NAME-0 and so on along the span")
    foot: Point = Field(description="middle of the span, at the level where the inner edges spring")
    span: PositiveLength = Field(description="clear width between the springings")
    rise: PositiveLength | None = Field(
        None, description="of the inner edge above the springing; absent: half the span, a half circle"
    )
    thickness: PositiveLength = Field(description="of the ring, along the joints")
    width: PositiveLength = Field(description="across the span")
    voussoirs: Annotated[int, Field(strict=True, ge=2, le=1000)] = Field(
        description="number of blocks in the ring"
    )
    along: Literal["x", "y"] = Field("x", description="direction of the span")
    abutment: tuple[PositiveLength, PositiveLength] | None = Field(
        None,
        description="length along the span and depth below the springing of two blocks that the arch stands on, "
        "NAME-low and NAME-high; absent: none",
    )
    abutment_fixed: Switch = Field(True, description="false: the abutments may move")
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")


class Rubble(Section):
    """Loose random blocks scattered in a box, none touching another."""

    name: Name = Field("rubble", description="the group of its blocks, NAME-0 and so on")
    lower: Point = Field(description="corner of the box with the smallest coordinates")
    size: Size = Field(
        description="edges of the box; a third of it can be filled with spheres around the blocks"
    )
    count: Annotated[int, Field(strict=True, ge=1, le=100_000)] = Field(description="number of blocks")
    diameter: tuple[PositiveLength, PositiveLength] = Field(
        description="smallest and largest of the spheres around the blocks", examples=[["20 cm", "40 cm"]]
    )
    shape: Literal["polyhedra", "boxes", "mixed"] = Field("polyhedra", description="what the blocks are")
    corners: Annotated[int, Field(strict=True, ge=4, le=100)] = Field(12, description="of each polyhedron")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(
        1, description="the same seed gives the same blocks"
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")


class BlockFile(Section):
    """Blocks from a mesh: each cell (tetrahedron, pyramid, wedge, hexahedron) or each closed convex surface is one."""

    name: Name = Field(
        "file", description="the group of its blocks, NAME-0 and so on in the order of the file"
    )
    path: Annotated[str, Field(min_length=1)] = Field(
        description="any format that meshio reads (STL, OBJ, PLY, MSH, VTK, VTU, ...), from the directory of the case",
        examples=["house.stl"],
    )
    scale: PositiveLength = Field(1.0, description="length of one unit of the file", examples=["1 mm"])
    offset: Point = Field((0.0, 0.0, 0.0), description="added to all places, after the scale")
    weld: PositiveLength | None = Field(
        None,
        description="corners closer than this are one; absent: a hundred-thousandth of the usual edge, or what the "
        "digits of the file resolve",
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description="a name that contact.pair may go by")
    fixed: Switch = Field(False, description="true: held in place for the whole run")


class Ground(Section):
    """A flat, rough ground without end under the blocks. With a tank its floor is ground as well."""

    level: Length = Field(0.0, description="height of the ground")
    material: Name = Field("ground", description="a name that contact.pair may go by")


class Structure(Section):
    """Rigid blocks. Absent: nothing moves but water, and YADE is never loaded."""

    density: Density = Field(2400.0, description="mass per volume of blocks that do not say their own")
    block: tuple[Block, ...] = Field((), description="single blocks")
    wall: tuple[MasonryWall, ...] = Field((), description="walls of equal blocks")
    building: tuple[Building, ...] = Field((), description="buildings with floors, roof and openings")
    column: tuple[Column, ...] = Field((), description="columns of drums")
    arch: tuple[Arch, ...] = Field((), description="arches of voussoirs")
    rubble: tuple[Rubble, ...] = Field((), description="loose random blocks")
    file: tuple[BlockFile, ...] = Field((), description="blocks from files")
    ground: Ground | None = Field(None, description="flat ground under the blocks")
    start: Literal["settled", "sudden"] = Field(
        "settled",
        description="settled: joined blocks that reach the ground start in equilibrium with their weight and the "
        "water around them; sudden: the weight comes on at once",
    )


class Contact(Section):
    """Spring, dashpot and friction between touching faces."""

    stiffness: quantity("N/m", gt=0) | None = Field(
        None,
        description="K of a pair of faces in contact, normal and tangential; absent: that of the joints in "
        "closing, so that a face whose joint breaks goes on as it was",
        examples=["1 GN/m"],
    )
    restitution: quantity("", ge=0, le=1) = Field(
        0.3, description="e, velocity after a normal impact over the velocity before"
    )
    friction: quantity("", ge=0) = Field(0.5, description="mu, largest tangential over normal force")
    audit: Switch = Field(
        False,
        description="true: count the work of dashpots and friction contact by contact in every substep (slow); "
        "false: take their sum from the balance of the other energies",
    )
    rule: Literal["exact", "paper"] = Field(
        "exact",
        description="dashpot that gives e exactly and never pulls, or the closed formula of the method",
    )


class Joints(Section):
    """Cohesion between touching faces, by default T = 27/4 T_max d (1 - d)^2, d = opening/opening_at_failure."""

    strength: quantity("Pa", gt=0) = Field(description="T_max, largest traction", examples=["0.5 MPa"])
    opening_at_failure: PositiveLength = Field(
        description="opening at which nothing holds any more", examples=["5 mm"]
    )
    law: Name = Field(
        "polynomial",
        description="polynomial, bilinear, exponential, or the name of another file in yade_scripts/laws",
    )
    peak: quantity("", gt=0, lt=1) | None = Field(
        None,
        description="opening at T_max over opening_at_failure; absent: 1/3 polynomial (fixed), 0.1 bilinear "
        "(0.01 to 0.9) and exponential (0.01 to 0.2)",
    )
    mixed_mode: Literal["effective", "needleman"] = Field(
        "effective",
        description="effective: one history for opening and sliding; needleman: his potential of 1987, polynomial "
        "law only, shear does not soften without opening",
    )
    shear_ratio: quantity("", gt=0) = Field(
        1.0,
        description="beta, weight of sliding in the effective opening and in the shear traction; needleman: "
        "square root of alpha",
    )
    closing_ratio: quantity("", gt=0) = Field(
        1.0, description="stiffness in compression over the first stiffness in tension"
    )
    damping: quantity("", ge=0, lt=1) = Field(
        0.02, description="share of critical damping, proportional to the stiffness of the joint"
    )
    points: Literal["auto"] | Annotated[int, Field(strict=True, ge=2, le=12)] = Field(
        "auto",
        description="Gauss points along each direction of a joined face; auto: for a peak moment to 2 %, from 3 up "
        "with closing_ratio and the law",
    )
    ground: Switch = Field(True, description="blocks that stand on the ground are glued to it")


class LevelGauge(Section):
    """Depth of water over a place: the wet length of the vertical through it."""

    kind: Literal["level"] = Field(description="what it measures: depth of water")
    name: Name = Field(description="column of the history")
    at: tuple[Length, Length] = Field(description="place (x, y)")


class PressureGauge(Section):
    """Pressure of the water at a point."""

    kind: Literal["pressure"] = Field(description="what it measures: pressure")
    name: Name = Field(description="column of the history")
    at: Point = Field(description="point (x, y, z); on the face of a solid or block: just outside of it")


class VelocityGauge(Section):
    """Velocity of the water at a point."""

    kind: Literal["velocity"] = Field(description="what it measures: velocity of the water")
    name: Name = Field(description="columns of the history")
    at: Point = Field(description="point (x, y, z)")


class VolumeGauge(Section):
    """Volume of the water inside a box."""

    kind: Literal["volume"] = Field(description="what it measures: volume of water")
    name: Name = Field(description="column of the history")
    lower: Point = Field(description="corner with the smallest coordinates")
    upper: Point = Field(description="corner with the largest coordinates")


class ForceGauge(Section):
    """Force of the water on a block, a group, a building or a solid."""

    kind: Literal["force"] = Field(description="what it measures: force of the water")
    name: Name = Field(description="columns of the history")
    on: Name = Field(
        description="name of a block, a group, a part of the structure (wall, arch, ...) or a solid"
    )


class ReactionGauge(Section):
    """Force that holds a block in place or to its prescribed motion, as a testing machine measures it."""

    kind: Literal["reaction"] = Field(description="what it measures: force that holds a block")
    name: Name = Field(description="columns of the history")
    on: Name = Field(description="name of a block, a group or a part of the structure (wall, arch, ...)")


class MotionGauge(Section):
    """Centre, velocity and rotation vector of one block."""

    kind: Literal["motion"] = Field(description="what it measures: motion of a block")
    name: Name = Field(description="columns of the history")
    of: Name = Field(description="name of a block")


Gauge = Annotated[
    LevelGauge | PressureGauge | VelocityGauge | VolumeGauge | ForceGauge | ReactionGauge | MotionGauge,
    Field(discriminator="kind"),
]


class Motion(Section):
    """A block that moves as prescribed, for instance the grip of a testing machine."""

    block: Name = Field(description="name of the block")
    velocity: VelocityVector = Field(description="its velocity for the whole run")


class Exchange(Section):
    """How water and blocks agree on a step."""

    passes: Annotated[int, Field(strict=True, ge=1, le=4)] = Field(
        2,
        description="most pressure solves in a step: the blocks' stiffness is in the first; with what the blocks then "
        "did, the step is taken again while the defect is above the tolerance",
    )
    tolerance: quantity("", gt=0, le=1) = Field(
        0.02, description="defect of a step above which another pass is made"
    )


class RunLimits(Section):
    """When a run stops early because its numbers are not to be trusted, or have cost enough."""

    volume_error: quantity("", gt=0) = Field(0.02, description="lost or gained share of the water")
    energy_error: quantity("", gt=0) = Field(0.05, description="unbalanced share of the energy put in")
    defect: quantity("", gt=0) = Field(
        0.5,
        description="mean over the last twenty steps of the share by which the blocks missed the motion that the "
        "water was told",
    )
    cpu_seconds: PositiveTime | None = Field(None, description="processor time that the run may take")


class Case(Section):
    """A whole case file."""

    case: About = Field(description="what the case is")
    time: Time = Field(description="how long and how often")
    tank: Tank | None = Field(None, description="the box for the water")
    water: Water | None = Field(None, description="the water")
    solid: tuple[Solid, ...] = Field((), description="fixed boxes")
    structure: Structure | None = Field(None, description="rigid blocks")
    contact: Contact | None = Field(None, description="what happens where blocks touch")
    joints: Joints | None = Field(None, description="glue between touching faces, which may break")
    gauge: tuple[Gauge, ...] = Field((), description="what is measured at every step")
    motion: tuple[Motion, ...] = Field((), description="blocks that move as prescribed")
    coupling: Exchange = Field(default_factory=Exchange, description="how water and blocks agree on a step")
    limits: RunLimits = Field(default_factory=RunLimits, description="when a run stops early")


def modules(case: Case) -> dict[str, bool]:
    """Which parts of the program a case switches on, by name, in the order in which they are told."""
    structure = case.structure is not None
    water = case.water is not None
    return {
        "water": water,
        "structure": structure,
        "coupling": water and structure,
        "fixed solids": bool(case.solid),
        "contact": case.contact is not None,
        "joints": case.joints is not None,
        "prescribed motion": bool(case.motion),
        "gauges": bool(case.gauge),
    }


def effective(case: Case) -> dict:
    """The case with every default filled in, as plain data in SI; `Case.model_validate` reads it back."""
    return case.model_dump(mode="json", exclude_none=True)
