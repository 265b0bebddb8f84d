"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CasePlace = Annotated[Path, typer.Argument(metavar="CASE", help="a case directory or a case.toml")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="change a value of the case, for instance time.end='2 s'"
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="number of threads; the results do not depend on it; default: SURGEBREAK_THREADS, else all cores of the "
        "process",
        show_default=False,
    ),
]
Laws = Annotated[
    list[Path] | None,
    typer.Option(
        "--law",
        metavar="FILE",
        help="a Python file that defines a cohesive law; its code is executed; may be repeated",
    ),
]


def take_laws(files: list[Path] | None) -> None:
    """Register the laws of files that the user named, also for child processes. Raises BadLaw."""
    for file in files or []:
        from coupler.api.laws import register_law

        register_law(file)
