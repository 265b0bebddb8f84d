"""The arguments of `surgebreak export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="a run directory, finished or still being written")
    ],
    format_: Annotated[
        str,
        typer.Option("--format", metavar="A,B,...", help="vtk (ParaView), netcdf (xarray), gltf (Blender)"),
    ] = "vtk,netcdf",
    to: Annotated[
        Path | None, typer.Option(metavar="DIR", help="directory for the files; default: RUN/export")
    ] = None,
    begin: Annotated[
        float,
        typer.Option("--from", metavar="S", help="time [s] of the first state; histories and maps are whole"),
    ] = 0.0,
    end: Annotated[float, typer.Option("--until", metavar="S", help="time [s] of the last state")] = float(
        "inf"
    ),
) -> None:
    """Write results for other programs.

    The formats are .pvd for ParaView, NetCDF for xarray and .glb for Blender. While a run is in progress, a repeated
    export adds only the new steps.
    """
    from coupler.commands.export.command import export as write

    write(run, [name.strip() for name in format_.split(",") if name.strip()], to, begin, end)
