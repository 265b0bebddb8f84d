"""The arguments of `surgebreak benchmark`."""

from __future__ import annotations

from typing import Annotated

import typer

from coupler.program.start import one_thread


def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="only small sizes")] = False,
    json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="PART",
            help="joints, scenes, sleep, dead, cutting, debris, water, solver, threads, roofline or stock",
        ),
    ] = None,
) -> None:
    """Measure the processor time of substeps, cutting and solvers.

    The exit code is 3 if a target is missed.
    """
    one_thread()
    from coupler.commands.benchmark.command import benchmark as measure

    raise typer.Exit(int(measure(quick, json, only)))
