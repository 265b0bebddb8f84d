"""The arguments of `surgebreak doctor`."""

from __future__ import annotations

from typing import Annotated

import typer

from coupler.program.start import one_thread


def doctor(
    mend: Annotated[
        bool,
        typer.Option(
            "--mend",
            help="repair what can be repaired: incomplete kernels, locked folders of the cache, missing packages",
        ),
    ] = False,
) -> None:
    """Check that YADE and all other parts work on this machine."""
    one_thread()
    from coupler.commands.doctor.command import examine

    raise typer.Exit(int(examine(mend)))
