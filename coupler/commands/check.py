"""The command `surgebreak check`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import CasePlace, Laws, Overrides, take_laws
from coupler.program.extras import need
from coupler.program.start import one_thread

MANY_SOLIDS = 200
"""Fixed solids from which the substep takes so long that `check` says it is at work."""


def check(
    case: CasePlace,
    set: Overrides = None,
    law: Laws = None,
    exact: Annotated[
        bool, typer.Option("--exact", help="also solve for the exact highest frequency of the joints")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="draw the blocks, solids and water at the start")
    ] = None,
) -> None:
    """Check a case, and forecast what its run will take.

    The forecast gives steps, processor time, memory and disk space. Nothing is run, but YADE is loaded to compute the
    substep of a structure.
    """
    one_thread()
    take_laws(law)
    from coupler.checks.read_case import load
    from coupler.program import terminal
    from coupler.run.compile_ahead import is_compiled
    from coupler.run.execute import describe
    from coupler.run.forecast import forecast

    if picture is not None:
        need("view")
    file = load(case, set or [])
    describe(file, partial(print, flush=True))
    if picture is not None:
        from coupler.commands.blocks.command import draw_case

        draw_case(file.case, picture)
        print(f"picture: {picture}")
    if file.case.structure is not None and len(file.case.solid) >= MANY_SOLIDS:
        print(f"the substep, with {len(file.case.solid)} fixed solids that blocks can touch, ...", flush=True)
    if file.case.structure is not None and file.case.joints is not None and not is_compiled("structure"):
        print(
            "compiling the kernels of joints for the substep, once for this version: half a minute or more",
            flush=True,
        )
    terminal.table("forecast", forecast(file.case, exact, file.directory).rows)
