"""The command `surgebreak run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import CasePlace, Laws, Overrides, Threads, take_laws
from coupler.program.start import one_thread
from coupler.program.threads import take_threads


def run(
    case: CasePlace,
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="a new directory for the results; default: runs/<time>-<hash> beside the case"
        ),
    ] = None,
    end: Annotated[str | None, typer.Option(metavar="TIME", help="short for --set time.end=...")] = None,
    dry: Annotated[bool, typer.Option("--dry", help="only read the case, without running it")] = False,
    threads: Threads = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="also show the run in the browser of this machine")
    ] = False,
) -> None:
    """Run a case. Ctrl-C or a file named `stop` in the run directory ends it cleanly."""
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.checks.read_case import load

    file = load(case, [*(set or []), *([f"time.end={end}"] if end else [])])
    if dry:
        print(f"{file.path}: {file.case.case.title}: no mistake found; nothing was run")
        return
    from coupler.run.directory import RunDirectory
    from coupler.run.execute import execute_case

    directory = RunDirectory.create(file, output)
    if not watch:
        raise typer.Exit(int(execute_case(file, directory)))
    from coupler.commands.watch.command import beside

    with beside(directory.path):
        code = execute_case(file, directory)
    raise typer.Exit(int(code))
