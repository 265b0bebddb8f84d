"""The command `surgebreak run`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from coupler.commands.shared_options import CasePlace, Laws, Overrides, Threads, take_laws
from coupler.program.start import one_thread
from coupler.program.threads import take_threads

if TYPE_CHECKING:
    from coupler.checks.read_case import CaseFile


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
    for line in _of_the_run(file):
        print(line)
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


def _of_the_run(file: CaseFile) -> Iterator[str]:
    """A note where the case is that of a run whose --set values, which its copy of the case lacks, are not given."""
    from coupler.run.summary import NoRun, read_summary

    try:
        lacking = [
            given for given in read_summary(file.directory)["overrides"] if given not in file.overrides
        ]
    except NoRun:
        return
    if lacking:
        sets = " ".join(f"--set {quote(given)}" for given in lacking)
        yield f"note: {file.directory} is a run that was made with {sets}, which {file.path.name} does not hold"
