"""The command `surgebreak init`."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer


def init(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="the new case directory")],
    template: Annotated[
        str,
        typer.Option(metavar="NAME", help="tank, wall, house, quay, harbour, column, terrain, town or dry"),
    ] = "tank",
    ask: Annotated[bool, typer.Option("--ask", help="ask at most six questions about the case")] = False,
) -> None:
    """Write a small commented case that runs."""
    from coupler.case.first_cases import write_first_case

    def answer(question: str, usual: str) -> str:
        return typer.prompt(question, default=usual)

    path, word = write_first_case(directory, template, answer if ask else None), quote(str(directory))
    print(f"wrote {path}; next: surgebreak check {word}, surgebreak run {word}")
