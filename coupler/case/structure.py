"""The tables below [structure]: single blocks, generators and files of blocks, and the ground."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from coupler.case.types import (
    MATERIAL,
    Density,
    Length,
    Name,
    Point,
    PositiveLength,
    PositiveTime,
    Rotation,
    Section,
    Size,
    SpinVector,
    Switch,
    VelocityVector,
    Wall,
)
from coupler.case.units import InSI


class Block(Section):
    """One rigid block that moves: a box (size), a convex polyhedron (vertices), or one that approximates a sphere
    (diameter)."""

    name: Name = Field(description="for joints, gauges, motions and results; one block a name")
    centre: Point | None = Field(
        None,
        description="centre of mass at the start; absent for a polyhedron: its vertices are the position",
    )
    size: Size | None = Field(None, description="edges of the box along its own axes")
    vertices: Annotated[tuple[Point, ...], Field(min_length=4)] | None = Field(
        None,
        description="corners of a convex polyhedron in any order, its faces are found; with a centre from any origin",
        examples=[[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]],
    )
    diameter: PositiveLength | None = Field(
        None,
        description="diameter of a sphere, approximated by a polyhedron of the same volume; its inertia is "
        "that of the sphere within 0.1 % (20 faces: 1.1 %). It rolls over its edges",
        examples=["30 cm"],
    )
    faces: Literal[20, 80, 320] | None = Field(
        None,
        description="triangles of a sphere; absent: 80. Its corners reach 18, 4.6, 1.2 % of the radius beyond the "
        "sphere; contact and cutting cost in proportion",
    )
    rotation: Rotation | None = Field(
        None, description="rotation about the centre of mass; absent: aligned with the axes"
    )
    velocity: VelocityVector = Field(
        (0.0, 0.0, 0.0),
        description="velocity of the centre at the start, of a block that neither is fixed nor has a [[motion]]",
    )
    spin: SpinVector = Field(
        (0.0, 0.0, 0.0), description="angular velocity at the start, world axes, of the same blocks"
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)
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

    name: Name = Field(
        "building",
        description="for joints, gauges and results: all of its blocks, which are called NAME-wall0x--0-0-0 and so on; "
        "their groups are wall, floor and roof",
    )
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
    material: Name = Field("block", description=MATERIAL)
    on: Literal["terrain"] | None = Field(
        None,
        description="terrain: it stands on a footing in the ground, a held box NAME-footing, and the z of lower counts "
        "from the highest ground under it",
    )
    turn: Annotated[float, InSI("rad")] = Field(
        0.0,
        description="turn about the upright axis through its middle, counter-clockwise",
        examples=["30 deg"],
    )
    pad: Annotated[float, InSI("m", ge=0)] = Field(
        0.0, description='with on = "terrain": how far its footing reaches beyond the walls'
    )
    outline: tuple[tuple[Length, Length], ...] | None = Field(
        None,
        description="corners of a footprint that is no rectangle, x and y from lower, within size; walls follow it as "
        "rings of convex strips, named NAME-wall0n0 by storey and edge; without openings",
        examples=[[[0, 0], [9, 0], [9, 4], [5, 4], [5, 8], [0, 8]]],
    )
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
    on: Literal["terrain"] | None = Field(
        None,
        description="terrain: it stands on a footing in the ground, a held box NAME-footing, and the z of lower counts "
        "from the highest ground under it",
    )
    turn: Annotated[float, InSI("rad")] = Field(
        0.0,
        description="turn about the upright axis through its middle, counter-clockwise",
        examples=["30 deg"],
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)


class Column(Section):
    """A stack of equal drums: boxes (size) or prisms of many sides (radius)."""

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
        None, description="the same at the top, of a tapered column; absent: radius"
    )
    sides: Annotated[int, Field(strict=True, ge=3, le=64)] = Field(12, description="sides of a round drum")
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)


class Arch(Section):
    """Wedge-shaped blocks (voussoirs) on a circle; their joints point to its centre."""

    name: Name = Field("arch", description="the group of its blocks; NAME-0 and so on along the span")
    foot: Point = Field(description="middle of the span, at the level where the inner edges spring")
    span: PositiveLength = Field(description="clear width between the springings")
    rise: PositiveLength | None = Field(
        None, description="rise of the inner edge above the springing; absent: half the span, a semicircle"
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
    abutment_fixed: Switch = Field(
        True,
        description="false: the abutments may move; one with a [[motion]] moves as prescribed in either case",
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)


class Rubble(Section):
    """Loose random blocks scattered in a box without contact."""

    name: Name = Field("rubble", description="the group of its blocks, NAME-0 and so on")
    lower: Point = Field(description="corner of the box with the smallest coordinates")
    size: Size = Field(
        description="edges of the box; a third of it can be filled with spheres around the blocks"
    )
    count: Annotated[int, Field(strict=True, ge=1, le=20_000)] = Field(description="number of blocks")
    diameter: tuple[PositiveLength, PositiveLength] = Field(
        description="smallest and largest of the spheres around the blocks", examples=[["20 cm", "40 cm"]]
    )
    shape: Literal["polyhedra", "boxes", "mixed"] = Field("polyhedra", description="what the blocks are")
    corners: Annotated[int, Field(strict=True, ge=4, le=100)] = Field(12, description="of each polyhedron")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(
        1, description="the same seed gives the same blocks"
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)


class TownRule(Section):
    """Values for the footprints with a certain attribute; of several rules that fit, the last is used."""

    attribute: str = Field(description="name of an attribute of the file", examples=["built"])
    equals: str | int | float | bool = Field(description="its value", examples=["brick"])
    storeys: Annotated[int, Field(strict=True, ge=1, le=100)] | None = Field(
        None, description="absent, like all below: that of the town"
    )
    storey_height: PositiveLength | None = Field(None, description="from floor to floor")
    wall_thickness: PositiveLength | None = Field(None, description="thickness of the walls")
    floor_thickness: PositiveLength | None = Field(None, description="thickness of floors and roof")
    block: tuple[PositiveLength, PositiveLength] | None = Field(
        None, description="wanted length and height of the blocks"
    )
    density: Density | None = Field(None, description="mass per volume")
    material: Name | None = Field(None, description=MATERIAL)


class Town(Section):
    """Houses on the terrain from a file of footprints: each is a building with walls, floors and a roof on its smallest
    rectangle or along its outline. They are called NAME-0, NAME-1, ... in the order of the file, or by name_from;
    further polygons of one feature end in -1, -2, ..."""

    name: Name = Field("town", description="prefix of the names of its houses")
    path: Annotated[str, Field(min_length=1)] = Field(
        description="polygons in coordinates of the terrain file: GeoJSON, or with the extra terrain Shapefile or "
        "GeoPackage; from the directory of the case",
        examples=["houses.geojson"],
    )
    crs: str | None = Field(
        None,
        description="coordinate system of the footprints, where it is not that of the terrain (which must then be "
        "given by terrain.reproject or terrain.crs); needs the extra terrain",
        examples=["EPSG:4326"],
    )
    name_from: str | None = Field(None, description="attribute that names each house")
    storeys_from: str | None = Field(None, description="attribute with the number of storeys")
    storeys: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(1, description="number of storeys")
    storey_height: PositiveLength = Field(3.0, description="from floor to floor")
    above_ground: Annotated[float, InSI("m", ge=0)] = Field(
        0.0, description="height of the lowest floor above the highest ground under the house"
    )
    wall_thickness: PositiveLength = Field(description="thickness of the walls", examples=["0.5 m"])
    floor_thickness: PositiveLength | None = Field(
        None, description="thickness of floors and roof; absent: wall_thickness"
    )
    block: tuple[PositiveLength, PositiveLength] = Field(
        description="wanted length and height of the blocks; changed so that whole numbers fit",
        examples=[["2 m", "1.5 m"]],
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)
    pad: Annotated[float, InSI("m", ge=0)] = Field(0.0, description="how far footings reach beyond the walls")
    shape: Literal["rectangle", "outline"] = Field(
        "rectangle",
        description="rectangle: houses stand on the smallest rectangle around their footprint, which must fill 70 % of "
        "it; outline: those that fill less than 98 % follow their footprint, as rings of convex strips",
    )
    least_area: Annotated[float, InSI("m2", ge=0)] = Field(
        0.0, description="smaller footprints, for instance of sheds, are left out"
    )
    rule: tuple[TownRule, ...] = Field((), description="values for some houses, by attributes of the file")


class BlockFile(Section):
    """Blocks from a mesh: each cell (tetrahedron, pyramid, wedge, hexahedron) or each closed convex surface is one."""

    name: Name = Field(
        "file",
        description="the group of its blocks, NAME-0 and so on in the order of the file; of several kinds of volume "
        "cells, or of surfaces of triangles beside those of quads, one kind after another",
    )
    path: Annotated[str, Field(min_length=1)] = Field(
        description="any format that meshio reads (STL, OBJ, PLY, MSH, VTK, VTU, ...), from the directory of the case",
        examples=["house.stl"],
    )
    scale: PositiveLength = Field(1.0, description="length of one unit of the file", examples=["1 mm"])
    offset: Point = Field((0.0, 0.0, 0.0), description="added to all places, after the scale")
    weld: PositiveLength | None = Field(
        None,
        description="corners closer than this are merged; absent: a hundred-thousandth of the usual edge, or what the "
        "digits of the file resolve",
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)
    fixed: Switch = Field(False, description="true: held in place for the whole run")


class DrawingLayer(Section):
    """One layer, object or group of a drawing, where it differs from the rest."""

    name: Name = Field(description="of the layer, as `surgebreak blocks FILE` lists them")
    material: Name | None = Field(None, description="absent, like all below: that of the drawing")
    density: Density | None = Field(None, description="mass per volume")
    size: PositiveLength | None = Field(None, description="as in the drawing")
    course: PositiveLength | None = Field(None, description="as in the drawing")
    bond: Literal["stack", "running"] | None = Field(None, description="as in the drawing")
    fixed: Switch = Field(False, description="true: held in place for the whole run")
    leave_out: Switch = Field(False, description="true: no blocks of this layer, for instance of furniture")


class Drawing(Section):
    """A building drawn as closed surfaces, cut along the planes of its faces into convex blocks of a size."""

    name: Name = Field(
        "drawing",
        description="its blocks are called NAME-wall0x--0 and so on, after wall, floor or roof and storey; groups are "
        "wall, floor, roof, pier and base",
    )
    path: Annotated[str, Field(min_length=1)] = Field(
        description="STL, OBJ, PLY, OFF, 3MF, glTF, or with the extras `cad` and `ifc` STEP, IGES, IFC, from the "
        "directory of the case",
        examples=["house.obj"],
    )
    size: PositiveLength = Field(
        description="wanted edge of the blocks along walls and slabs; changed so that whole numbers fit. Walls and "
        "slabs are one block thick, unless they are thicker than that",
        examples=["1.2 m"],
    )
    course: PositiveLength | None = Field(
        None, description="wanted height of the blocks in walls; absent: size"
    )
    bond: Literal["stack", "running"] = Field(
        "stack", description="stack: joints in line; running: every other course shifted by half a block"
    )
    scale: PositiveLength = Field(1.0, description="length of one unit of the file", examples=["1 mm"])
    offset: Point = Field((0.0, 0.0, 0.0), description="added to all places, after the scale")
    up: Literal["z", "y"] = Field("z", description="axis of the file that points up")
    weld: PositiveLength | None = Field(
        None, description="corners closer than this are merged; absent: what the digits of the file resolve"
    )
    sliver: PositiveLength | None = Field(
        None,
        description="parts narrower than this are merged with a neighbour where both make a convex block; absent: a "
        "quarter of the usual thickness",
    )
    most_blocks: Annotated[int, Field(strict=True, ge=1, le=20_000)] = Field(
        5000,
        description="largest number of blocks; more are refused before the cutting, most often because the unit of "
        "the file (scale) is wrong",
    )
    density: Density | None = Field(None, description="mass per volume; absent: structure.density")
    material: Name = Field("block", description=MATERIAL)
    fixed: Switch = Field(False, description="true: held in place for the whole run")
    layer: tuple[DrawingLayer, ...] = Field((), description="layers that differ from the rest")


class Ground(Section):
    """A horizontal, infinite ground with friction under the blocks. The floor of a tank is ground as well."""

    level: Length = Field(0.0, description="height of the ground")
    material: Name = Field("ground", description="a name to which contact.pair may refer")


class Sleep(Section):
    """Buildings whose loads do not change make no substeps. Absent: every block makes every substep. What is asleep
    does not move; it wakes before a load acts on it that would change a traction in its joints by more than
    `share` of their strength, or when a loose block approaches. Only blocks that joints hold to the ground or to
    held blocks, with nothing loose among them, fall asleep: at the start, or after a period of their slowest
    oscillation at rest."""

    share: Annotated[float, InSI("", gt=0, le=0.5)] = Field(
        0.02,
        description="largest error of a traction in a joint while it sleeps, over the strength of the joint; waking "
        "changes the traction by as much again",
        examples=["2 %"],
    )


class Structure(Section):
    """Rigid blocks. Absent: only the water moves, and YADE is not loaded."""

    density: Density = Field(2400.0, description="density of blocks that have no density of their own")
    block: tuple[Block, ...] = Field((), description="single blocks")
    wall: tuple[MasonryWall, ...] = Field((), description="walls of equal blocks")
    building: tuple[Building, ...] = Field((), description="buildings with floors, roof and openings")
    column: tuple[Column, ...] = Field((), description="columns of drums")
    arch: tuple[Arch, ...] = Field((), description="arches of voussoirs")
    rubble: tuple[Rubble, ...] = Field((), description="loose random blocks")
    file: tuple[BlockFile, ...] = Field((), description="blocks from files")
    drawing: tuple[Drawing, ...] = Field((), description="buildings from drawings, cut into blocks")
    town: tuple[Town, ...] = Field((), description="houses on the terrain from files of footprints")
    ground: Ground | None = Field(None, description="horizontal ground under the blocks")
    start: Literal["settled", "sudden", "ramp"] = Field(
        "settled",
        description="settled: joined blocks that reach the ground start in equilibrium with their weight and the "
        "water around them; sudden: the full weight acts from the start; ramp: the weight increases gradually over "
        "the time `ramp`, while the water acts in full from the start",
    )
    ramp: PositiveTime | None = Field(
        None,
        description="with start = 'ramp', the time over which the weight of the blocks increases to its full value, "
        "as tau^2 (3 - 2 tau); after several periods of the structure it is nearly at rest",
        examples=["2 s"],
    )
    substep: PositiveTime | None = Field(
        None,
        description="longest step of the motion of the blocks; absent: the one at which energy is accurate. Longer "
        "ones are permitted, with a note, up to the limit of stability",
    )
    sleep: Sleep | None = Field(None, description="buildings whose loads do not change are not computed")
