"""The arguments of `surgebreak verify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.program.extras import need
from coupler.program.start import one_thread


def verify(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="ID", help="cases (P01 ...); default: all")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="only the cheap cases, which take three minutes of processor time")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="print one JSON object per quantity, one per line")
    ] = False,
    list_: Annotated[
        bool, typer.Option("--list", help="list the cases, and the checks that are not covered")
    ] = False,
    plots: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="folder for figures of computed and measured curves"),
    ] = None,
) -> None:
    """Compare results with exact solutions and measured records.

    The exit code is 3 if a quantity exceeds its tolerance.
    """
    one_thread()
    if plots is not None:
        need("view")
    from coupler.commands.verify.report import verify as run_cases

    raise typer.Exit(int(run_cases(ids or [], quick=quick, as_json=json, only_list=list_, plots=plots)))
