"""The arguments of `surgebreak study`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import Laws, take_laws
from coupler.program.start import one_thread


def study(
    words: Annotated[
        list[Path],
        typer.Argument(
            metavar="CASE", help="a case with a section [study]; or: compare A B, with two studies"
        ),
    ],
    ladder: Annotated[
        str,
        typer.Option(
            metavar="A,B,...", help="names of ladders, separated by commas; default: all of the case"
        ),
    ] = "",
    repeat: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="number of times that each run is made; default: study.repeat of the case",
        ),
    ] = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="directory of the study; default: runs/study beside the case"),
    ] = None,
    larger: Annotated[bool, typer.Option("--larger", help="include the larger rungs of the ladders")] = False,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="keep runs that another version of the program made")
    ] = False,
    error: Annotated[
        float,
        typer.Option(min=1.0, metavar="RATIO", help="compare: largest permitted ratio of errors, B over A"),
    ] = 1.1,
    cpu: Annotated[
        float,
        typer.Option(
            min=1.0, metavar="RATIO", help="compare: largest permitted ratio of CPU seconds, B over A"
        ),
    ] = 1.2,
) -> None:
    """Measure errors against run time over the ladders of a case.

    A study that was stopped is continued. `study compare A B` ends with exit code 3 if B is worse than A.
    """
    one_thread()
    take_laws(law)
    if len(words) == 3 and str(words[0]) == "compare":
        from coupler.commands.study.against import compare as compare_studies

        raise typer.Exit(int(compare_studies(words[1], words[2], error, cpu)))
    if len(words) != 1:
        raise typer.BadParameter("give one case, or: compare A B")
    from coupler.commands.study.command import study as make_study

    names = [name.strip() for name in ladder.split(",") if name.strip()]
    raise typer.Exit(int(make_study(words[0], names, repeat, output, larger, any_version)))
