"""The arguments of `surgebreak stress`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.program.start import one_thread


def stress(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="ID",
            help="scenes (S01 ..., R1-12 ...) or groups: structure, water, coupling; default: all",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="only scenes that take less than a minute")] = False,
    json: Annotated[
        bool, typer.Option("--json", help="print one JSON object per scene, one per line")
    ] = False,
    list_: Annotated[bool, typer.Option("--list", help="list the scenes")] = False,
    random: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="run N random scenes from the whole case format instead"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="seed of the random scenes")] = 1,
    first: Annotated[
        int, typer.Option("--from", min=0, metavar="K", help="number of the first random scene")
    ] = 0,
    group: Annotated[
        list[str] | None, typer.Option(metavar="GROUP", help="only scenes of this group; may be repeated")
    ] = None,
    keep: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="directory for random scenes that fail, as cases, complete and reduced"
        ),
    ] = Path("stress-failures"),
    shrink: Annotated[
        float,
        typer.Option(min=0.0, metavar="SECONDS", help="processor time for the reduction of each of them"),
    ] = 60.0,
) -> None:
    """Run stiff and extreme scenes, or random ones.

    A scene passes, is refused with a message, or fails. The exit code is 3 if one fails.
    """
    one_thread()
    from coupler.commands.stress.drawn.command import are_drawn, named, numbered, stress_drawn

    words = [*(scenes or []), *(group or [])]
    if random is not None or are_drawn(words):
        asked = named(words) if random is None else numbered(seed, random, first, words)
        raise typer.Exit(int(stress_drawn(asked, keep, shrink, as_json=json, only_list=list_)))
    from coupler.commands.stress.report import stress as run_scenes

    raise typer.Exit(int(run_scenes(words, quick=quick, as_json=json, only_list=list_)))
