"""The section [terrain]: the ground of a case from a file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from coupler.case.types import Length, Name, Number, Point, PositiveLength, Section, Switch
from coupler.case.units import InSI


class LandUse(Section):
    """A kind of ground: its code in the map, and its friction by the law that [water] has."""

    code: int = Field(description="its number in the map", examples=[41])
    name: str = Field("", description="name in messages", examples=["forest"])
    manning: Annotated[float, InSI("", gt=0, le=1)] | None = Field(
        None, description="Manning's n [s/m^(1/3)], for water.manning", examples=[0.1]
    )
    roughness: PositiveLength | None = Field(None, description="sand roughness k_s, for water.roughness")


class Land(Section):
    """The friction of the ground by a map: codes of land use with a table `use` for each, or the numbers themselves.
    The nearest point of the map is used; outside the map and in its holes, water.manning or water.roughness is."""

    path: Annotated[str, Field(min_length=1)] = Field(
        description="a raster as terrain.path, in the same coordinates (after reproject)",
        examples=["land_use.asc"],
    )
    variable: Name | None = Field(None, description="of a NetCDF file with several")
    use: tuple[LandUse, ...] = Field(
        (), description="kinds of ground by their codes; absent: the map holds n, or k_s in metres"
    )


class Terrain(Section):
    """The ground as a height over every place, from a file. The mesh of the tank ends on it: it is the bed of the water
    and dry land; buildings may stand on it. Heights come out in metres, z up; `surgebreak terrain` shows them."""

    path: Annotated[str, Field(min_length=1)] = Field(
        description="ESRI ASCII grid (.asc), rows of x, y, z (.csv, .xyz, .txt), NetCDF (.nc, .grd), a surface of "
        "triangles (.stl, .ply, .obj), or GeoTIFF (.tif; needs the extra terrain), from the directory of the case",
        examples=["site.asc"],
    )
    variable: Name | None = Field(None, description="of a NetCDF file with several")
    crs: str | None = Field(
        None, description="coordinate system of a file that does not contain it", examples=["EPSG:4326"]
    )
    reproject: str | None = Field(
        None,
        description="metric coordinate system to change to, needed for degrees; needs the extra terrain",
        examples=["EPSG:32654"],
    )
    scale: PositiveLength = Field(
        1.0,
        description="length of one unit of the file along x and y; not with reproject, which makes metres",
        examples=["1 ft"],
    )
    height_scale: PositiveLength | None = Field(
        None, description="the same for its heights; absent: scale (with reproject: metres)"
    )
    positive: Literal["up", "down"] = Field("up", description="down: the file holds depths")
    no_data: Annotated[float, Field(allow_inf_nan=False)] | None = Field(
        None,
        description="number in the file that stands for no height, where the file itself does not say so",
        examples=[-9999],
    )
    zero: Length = Field(
        0.0,
        description="height above the datum of the file that becomes z = 0, for instance of the sea that day",
    )
    crop: tuple[tuple[Number, Number], tuple[Number, Number]] | None = Field(
        None,
        description="lowest and highest x, y that are kept, in the coordinates of the file (after reproject)",
        examples=[[[388_200, 4_253_000], [388_900, 4_253_600]]],
    )
    origin: tuple[Length, Length] | None = Field(
        None,
        description="x, y of the file that are moved to offset; absent: its corner with the lowest coordinates, of "
        "its cells where the file consists of cells",
    )
    turn: Annotated[float, InSI("rad")] = Field(
        0.0, description="rotation about origin, counter-clockwise", examples=["30 deg"]
    )
    offset: Point = Field(
        (0.0, 0.0, 0.0), description="position of origin in the tank; z is added to all heights"
    )
    fill: Switch = Field(False, description="true: holes are closed smoothly from their edges")
    smooth: PositiveLength | None = Field(
        None, description="length over which heights are averaged (standard deviation of a Gaussian)"
    )
    steepest: Annotated[float, InSI("rad", gt=0, lt=1.5)] | None = Field(
        None,
        description="steepest slope that is kept; cliffs are cut back from their foot",
        examples=["60 deg"],
    )
    land: Land | None = Field(
        None, description='friction of the ground by a map, with water.walls = "friction"'
    )
