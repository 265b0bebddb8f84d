"""The arguments of `surgebreak terrain`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.program.extras import need
from coupler.program.start import one_thread


def terrain(
    place: Annotated[
        Path,
        typer.Argument(
            metavar="FILE|CASE|RUN", help="a terrain file, a case with a section [terrain], or a run of one"
        ),
    ],
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="change a value of [terrain], for instance terrain.scale='1 ft'",
        ),
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="PNG", help="draw a map; needs the extra `view`")
    ] = None,
) -> None:
    """Show a terrain, and how well cells represent it.

    Tables give its extent, heights and slopes, and how much of the ground is lost with cells of several sizes. For a
    run it lists the maps of the flood; --map draws them in one picture with solids, blocks
    and the state of the buildings.
    """
    one_thread()
    if map_ is not None:
        need("view")
    from coupler.commands.terrain.command import show

    show(place, set or [], map_)
