"""The arguments of `surgebreak render`, which the process that draws reads itself."""

from __future__ import annotations

import typer

from coupler.program.process import run_module


def render(context: typer.Context) -> None:
    """Make stills, a film and plots of a run."""
    raise typer.Exit(run_module("coupler.commands.view", *context.args).returncode)
