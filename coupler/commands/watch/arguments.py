"""The arguments of `surgebreak watch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def watch(
    places: Annotated[list[Path], typer.Argument(metavar="RUN", help="runs, sweeps, or folders with runs")],
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="port of the page; 0 takes any free one")
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open the browser")] = False,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="draw a new picture from time to time")
    ] = True,
) -> None:
    """Show runs in the browser while they are in progress.

    The page shows the progress, the time left, histories, the newest picture, the present verdict and the limits, and
    has a button that stops a run. It is accessible only from this machine, at a secret address.
    """
    from coupler.commands.watch.command import watch as serve

    serve(places, port, browser, pictures)
