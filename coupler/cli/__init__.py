"""The command line by a short name: `python -m coupler.cli` is `surgebreak`."""

from coupler.commands.cli import main

__all__ = ["main"]
