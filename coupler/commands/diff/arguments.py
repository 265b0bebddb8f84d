"""The arguments of `surgebreak diff`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def diff(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN RUN...", help="the directories of two runs or more")
    ],
    to: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="write diff.html with the histories drawn over one another, and diff.json, there",
        ),
    ] = None,
    curve: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TABLE.COLUMN",
            help="a history to draw instead of gauges and broken joints, for instance water.volume; may be repeated",
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Show how runs differ, in their cases and in their results.

    The first run is the one that the others are compared with. The table has the keys of the case whose values differ,
    the verdicts, the largest loads, what the gauges measured, errors and processor time. It compares runs of this
    program; the laws of its joints with those of YADE are compared by `surgebreak compare`.
    """
    from coupler.commands.diff.command import diff as show

    show(runs, to, curve or [], json)
