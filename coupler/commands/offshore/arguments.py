"""The arguments of `surgebreak offshore`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.program.start import one_thread


def offshore(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="an offshore.toml, or the directory that holds one")
    ],
) -> None:
    """Compute the sea off a coast with ANUGA, for a side of a case.

    It writes a record of the wave that comes in through that side. The coupling is one-way: a wide and coarse sea is
    driven by a source or a record, and the flow at the side of the tank is written to a CSV file. Needs the extra
    `offshore`; docs/terrain.md describes the file.
    """
    one_thread()
    from coupler.commands.offshore.command import offshore as make

    print(f"record: {make(file)}")
