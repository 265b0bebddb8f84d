"""The command `surgebreak explain`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def explain(
    context: typer.Context,
    key: Annotated[
        str | None,
        typer.Argument(
            metavar="KEY|RUN",
            help="a key of the case file, for instance joints.strength, or a run directory",
        ),
    ] = None,
) -> None:
    """Explain a key of the case file, or what a run did not compute.

    Without an argument it lists all sections. For a run it lists what was skipped, and what that would have cost.
    """
    if key and (os.sep in key or (Path(key) / "run.json").is_file()):
        from coupler.commands.explain_run import explanation_of_run

        print(explanation_of_run(Path(key)))
        return
    from coupler.case.docs import explanation
    from coupler.program.errors import UnknownName

    try:
        print(explanation(key))
    except UnknownName:
        if key not in context.parent.command.commands:
            raise
        raise UnknownName(
            f"{key}: a command, no name of a case file; `surgebreak {key} --help` explains it"
        ) from None
