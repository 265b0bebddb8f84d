"""The command `surgebreak report`: the pages of runs and studies are in `report`, those of sweeps in `sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    place: Annotated[
        Path, typer.Argument(metavar="RUN|STUDY|SWEEP", help="the directory of a run, a study or a sweep")
    ],
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="include stills and figures of a run")
    ] = True,
) -> None:
    """Write one HTML page about a run, a study or a sweep.

    The file report.html in the directory contains pictures, figures and tables, for screen and paper.
    """
    if (place / "sweep.json").is_file():
        from coupler.commands.sweep.command import finish
        from coupler.commands.sweep.folder import read_spec

        finish(read_spec(place), stopped=False)
        return
    from coupler.commands.report.command import report as write

    print(f"report: {write(place, pictures)}")
