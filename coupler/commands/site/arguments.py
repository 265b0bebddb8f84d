"""The arguments of `surgebreak docs`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def docs(
    build: Annotated[
        Path | None,
        typer.Option("--build", metavar="DIR", help="only build the site in this folder, without opening it"),
    ] = None,
) -> None:
    """Build the site of the documentation and open it."""
    from coupler.commands.site.command import docs as make_site

    raise typer.Exit(int(make_site(build)))
