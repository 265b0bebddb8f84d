"""The arguments of `surgebreak blocks`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.program.start import one_thread

DRAWN_AS_USUAL = (("bond", "stack"), ("scale", "1 m"), ("up", "z"))
"""Options with the default value of a case."""


def blocks(
    drawing: Annotated[
        Path, typer.Argument(metavar="FILE", help="a drawing: STL, OBJ, PLY, ...; STEP and IFC with extras")
    ],
    size: Annotated[
        str, typer.Option(metavar="M", help="intended length of the blocks along walls and slabs")
    ] = "1 m",
    course: Annotated[
        str | None,
        typer.Option(metavar="M", help="intended height of the blocks in walls; default: the size"),
    ] = None,
    bond: Annotated[
        str, typer.Option(metavar="NAME", help="bond of the blocks in walls: stack or running")
    ] = "stack",
    scale: Annotated[
        str, typer.Option(metavar="M", help="length of one unit of the file, for instance '1 mm'")
    ] = "1 m",
    up: Annotated[str, typer.Option(metavar="AXIS", help="axis of the file that points up: z or y")] = "z",
    sliver: Annotated[
        str | None,
        typer.Option(metavar="M", help="parts narrower than this are merged with their neighbours"),
    ] = None,
    most_blocks: Annotated[
        int | None, typer.Option(metavar="N", help="more blocks are refused; default: 5000")
    ] = None,
    density: Annotated[
        str | None, typer.Option(metavar="KG/M3", help="density of the blocks, for instance '1800 kg/m3'")
    ] = None,
    strength: Annotated[
        str, typer.Option(metavar="PA", help="strength of the joints, for the forecast")
    ] = "0.5 MPa",
    opening: Annotated[
        str, typer.Option(metavar="M", help="opening of the joints at failure, for the forecast")
    ] = "1 mm",
    picture: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="file of the picture; default: FILE_blocks.png beside the drawing"),
    ] = None,
    to: Annotated[
        Path | None, typer.Option(metavar="OBJ", help="also write the blocks as closed surfaces")
    ] = None,
) -> None:
    """Cut a drawing of a building into blocks.

    It reports the number of blocks, what determines the substep and what a second of simulation costs, draws the
    blocks, and prints the lines for a case.
    """
    one_thread()
    from coupler.commands.blocks.command import as_number
    from coupler.commands.blocks.command import blocks as cut

    given = {"size": size, "course": course, "bond": bond, "scale": scale, "up": up, "sliver": sliver}
    given["density"] = density
    options = {k: as_number(v) for k, v in given.items() if v is not None and (k, v) not in DRAWN_AS_USUAL}
    options |= {} if most_blocks is None else {"most_blocks": most_blocks}
    joints = {"strength": strength, "opening_at_failure": opening}
    cut(drawing, options, joints, picture, to)
