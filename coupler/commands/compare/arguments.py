"""The arguments of `surgebreak compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import CasePlace, Laws, Overrides, take_laws
from coupler.program.start import one_thread


def compare(
    case: CasePlace,
    laws: Annotated[
        str,
        typer.Option(
            metavar="A,B,...",
            help="separated by commas; default: all of this program, cohfrict, jcfpm, mortar and cpm; see `--list`",
        ),
    ] = "",
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="a new directory for the results; default: runs/compare-<time> beside the case",
        ),
    ] = None,
    substeps: Annotated[
        str,
        typer.Option(
            metavar="N,N,...", help="multiples of the substep of the case, for the error against run time"
        ),
    ] = "1,2,4,8",
    records: Annotated[int, typer.Option(min=10, metavar="N", help="number of rows of the tables")] = 1000,
    list_: Annotated[
        bool,
        typer.Option("--list", help="list the laws, and the properties that the laws of YADE cannot match"),
    ] = False,
) -> None:
    """Compare the cohesive laws of this program with those of YADE.

    A case without water is run with each of them. A case with [water] is refused: YADE's own scenes know no water. For
    such a case run each law by `run --set joints.law=NAME`. The parameters of the laws are matched as far as possible.
    The results are a table, a figure, CSV, JSON, and scripts for YADE.
    """
    one_thread()
    take_laws(law)
    from coupler.commands.compare.command import compare as run_laws
    from coupler.commands.compare.command import show_laws

    raise typer.Exit(
        int(show_laws() if list_ else run_laws(case, laws, set or [], output, substeps, records))
    )
