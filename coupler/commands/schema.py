"""The command `surgebreak schema`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    to: Annotated[
        Path | None, typer.Option("--to", metavar="FILE", help="file to write; default: standard output")
    ] = None,
) -> None:
    """Print the JSON Schema of case.toml, for editors.

    Editors complete and check the keys of a case with it; docs/editor.md describes how to set up an editor.
    """
    from coupler.case.editor_schema import write

    write(to)
