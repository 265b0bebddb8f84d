"""The command `surgebreak test`."""

from __future__ import annotations

import typer

from coupler.program.errors import SurgebreakError
from coupler.program.extras import need
from coupler.program.process import run_module
from coupler.program.start import one_thread


class NoTests(SurgebreakError):
    """The installation has no checkout, and with it no tests."""


def test(context: typer.Context) -> None:
    """Run the tests; further arguments are passed to pytest."""
    from coupler.program.provenance import ROOT

    if not (
        ROOT / "tests" / "conftest.py"
    ).exists():  # pytest would collect those of all packages beside this one
        raise NoTests(
            f"{ROOT}: no checkout, so there are no tests to run; they are in the source, under tests/"
        )
    need("test")
    one_thread()
    raise typer.Exit(run_module("pytest", *context.args, cwd=ROOT).returncode)
