"""The command `surgebreak test`."""

from __future__ import annotations

import typer

from coupler.program.extras import need
from coupler.program.process import run_module
from coupler.program.start import one_thread


def test(context: typer.Context) -> None:
    """Run the tests; further arguments are passed to pytest."""
    need("test")
    one_thread()
    from coupler.program.provenance import ROOT

    raise typer.Exit(run_module("pytest", *context.args, cwd=ROOT).returncode)
