"""The file of an offshore run: a wide and coarse sea in the coordinates of the tank of a case near the coast."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationError

from coupler.case.inflow_records import RecordError, record_of
from coupler.case.messages import explain_error
from coupler.case.paths import BadPath, place_of, read_text
from coupler.case.terrain import Terrain
from coupler.case.types import KeyPath, Length, PositiveLength, PositiveTime, Section, Wall
from coupler.case.units import InSI
from coupler.case.water import File, RecordInflow
from coupler.checks.read_case import table_of
from coupler.program.errors import BadCase, did_you_mean

Place = tuple[Length, Length]


class Near(Section):
    """Where the record goes: a side of the case at the coast."""

    case: File = Field(description="directory or case.toml, from the directory of this file")
    side: Wall = Field(description="the side of its tank that the record is for")
    points: int = Field(
        1, ge=1, le=200, strict=True, description="places along the side, evenly between its ends"
    )
    record: File = Field("offshore.csv", description="the file to write, from the directory of this file")


class Sea(Section):
    """The sea, in the coordinates of the tank of the near case: triangles, four in each square of `cell`."""

    lower: Place = Field(description="corner with the smallest x, y")
    upper: Place = Field(description="corner with the largest x, y")
    cell: PositiveLength = Field(description="edge of the squares; changed so that whole numbers fit")
    level: Length = Field(0.0, description="height z of the still water")
    floor: Length | None = Field(None, description="height z of a level bed, instead of [terrain]")
    manning: Annotated[float, InSI("", ge=0, le=1)] = Field(
        0.025, description="Manning's n of the bed [s/m^(1/3)]"
    )
    open: tuple[Wall, ...] = Field((), description="sides beyond which the sea goes on; the others are walls")
    end: PositiveTime = Field(description="the run ends at this time")
    every: PositiveTime = Field(1.0, description="time between two lines of the record")


class Hump(Section):
    """Water that stands higher (or lower) at the start in the shape of a Gauss curve, at rest."""

    kind: Literal["hump"] = Field(description="a hump of water")
    centre: Place = Field(description="x, y of its middle")
    height: Length = Field(description="of its middle over the still water; negative: a hollow")
    width: tuple[PositiveLength, PositiveLength] = Field(description="standard deviations along x and y")


class Uplift(Section):
    """Water at rest whose level at the start lies above still water by the heights of a map: the displacement of the
    bed by an earthquake, from any program."""

    kind: Literal["uplift"] = Field(description="a map of the displacement")
    path: File = Field(
        description="a raster as terrain.path in the same coordinates, heights in metres; beside it nothing is moved"
    )


Source = Annotated[Hump | Uplift, Field(discriminator="kind")]


class Offshore(Section):
    """A whole offshore file."""

    near: Near = Field(description="the case that the record is for")
    sea: Sea = Field(description="the sea")
    terrain: Terrain | None = Field(None, description="its bed, as in a case, for the tank of the near case")
    source: tuple[Source, ...] = Field((), description="what moves the water at the start; several add up")
    inflow: tuple[RecordInflow, ...] = Field((), description="records through sides of the sea, as in a case")


def read(path: Path) -> Offshore:
    """The file with its paths made whole. Raises BadCase with a line for each mistake."""
    if path.is_dir():
        path = path / "offshore.toml"
    try:
        table = table_of(read_text(path), str(path))
    except BadPath as error:
        raise BadCase([f"{path}: {error}"]) from error
    try:
        found = Offshore.model_validate(table)
    except ValidationError as error:
        lines = []
        for item in error.errors():
            place, text = (
                (item["loc"], _unknown(item)) if item["type"] == "extra_forbidden" else explain_error(item)
            )
            lines.append(f"{path}: {_shown(place)}: {text}")
        raise BadCase(lines) from None
    found, nowhere = _placed(found, path.parent)
    wrong = [f"{path}: {_shown(place)}: {text}" for place, text in nowhere or _mistakes(found)]
    if wrong:
        raise BadCase(wrong)
    return found


def _shown(place: KeyPath) -> str:
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _unknown(item: dict) -> str:
    name, section = str(item["loc"][-1]), {"near": Near, "sea": Sea, "terrain": Terrain}
    of = section.get(str(item["loc"][0])) if len(item["loc"]) > 1 else Offshore
    known = list(of.model_fields) if of is not None else []
    return f"unknown name{did_you_mean(name, known)}" + (f"; known here: {', '.join(known)}" if known else "")


def _placed(found: Offshore, directory: Path) -> tuple[Offshore, list[tuple[KeyPath, str]]]:
    """Paths resolved from the directory of the file, and those that do not exist."""
    wrong: list[tuple[KeyPath, str]] = []

    def placed(section, key: str, place: KeyPath):
        try:
            return section.model_copy(update={key: str(place_of(getattr(section, key), directory))})
        except BadPath as error:
            wrong.append(((*place, key), str(error)))
            return section

    near = placed(placed(found.near, "case", ("near",)), "record", ("near",))
    terrain = None if found.terrain is None else placed(found.terrain, "path", ("terrain",))
    source = tuple(
        placed(s, "path", ("source", i)) if s.kind == "uplift" else s for i, s in enumerate(found.source)
    )
    inflow = tuple(placed(s, "path", ("inflow", i)) for i, s in enumerate(found.inflow))
    return found.model_copy(
        update={"near": near, "terrain": terrain, "source": source, "inflow": inflow}
    ), wrong


def _mistakes(found: Offshore):
    """Faults that a schema cannot express."""
    sea = found.sea
    if any(low >= high for low, high in zip(sea.lower, sea.upper)):
        yield ("sea", "upper"), "must lie above sea.lower in x and y"
    if (found.terrain is None) == (sea.floor is None):
        yield ("sea", "floor"), "give the bed once: sea.floor, or a section [terrain]"
    if not (found.source or found.inflow):
        yield ("source",), "nothing moves the water: write a [[source]] or an [[inflow]]"
    taken = {side: "sea.open" for side in sea.open}
    for i, spec in enumerate(found.inflow):
        if spec.side in taken:
            yield ("inflow", i, "side"), f"{spec.side} is given to {taken[spec.side]} already"
        taken[spec.side] = f"inflow[{i}]"
        if spec.absorbs:
            yield (
                ("inflow", i, "absorbs"),
                "sides of the offshore sea let go what comes back anyway; leave it out",
            )
        try:
            record = record_of(spec)
        except RecordError as error:
            yield ("inflow", i, "path"), str(error)
            continue
        if record.varies:
            yield (
                ("inflow", i, "path"),
                "one place for the whole side is needed here; leave the column along out",
            )
        elif sea.floor is not None and np.min(record.level) < sea.floor:
            yield ("inflow", i, "path"), f"its level falls to z = {np.min(record.level):g} m, below sea.floor"
