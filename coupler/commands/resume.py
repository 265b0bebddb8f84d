"""The command `surgebreak resume`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import Laws, Threads, take_laws
from coupler.program.start import one_thread
from coupler.program.threads import take_threads


def resume(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="the directory of a run that stopped")],
    end: Annotated[
        str | None, typer.Option(metavar="TIME", help="new end time; short for --set time.end=...")
    ] = None,
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="change time.*, for instance time.output_every, limits.*, coupling.* or a share of the verdict; "
            "names that must stay are refused with the reason",
        ),
    ] = None,
    law: Laws = None,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="continue although the program has changed since")
    ] = False,
    threads: Threads = None,
) -> None:
    """Continue a run that was stopped or killed.

    It is continued from its newest checkpoint.
    """
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.run.execute import execute_case
    from coupler.run.resume import prepare

    found = prepare(run, [*(set or []), *([f"time.end={end}"] if end else [])], any_version)
    raise typer.Exit(int(execute_case(found.file, found.directory, found.checkpoint)))
