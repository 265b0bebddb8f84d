"""The command `surgebreak`. Each command has a file of its own, which imports what the command works with only
when it is called, so that help is fast."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer
from typer.core import TyperGroup

from coupler.commands.benchmark.arguments import benchmark
from coupler.commands.blocks.arguments import blocks
from coupler.commands.check import check
from coupler.commands.compare.arguments import compare
from coupler.commands.diff.arguments import diff
from coupler.commands.doctor.arguments import doctor
from coupler.commands.explain import explain
from coupler.commands.export.arguments import export
from coupler.commands.init import init
from coupler.commands.kernels import kernels
from coupler.commands.offshore.arguments import offshore
from coupler.commands.report_command import report
from coupler.commands.resume import resume
from coupler.commands.run import run
from coupler.commands.schema import schema
from coupler.commands.site.arguments import docs
from coupler.commands.stress.arguments import stress
from coupler.commands.study.arguments import study
from coupler.commands.sweep.arguments import sweep
from coupler.commands.terrain.arguments import terrain
from coupler.commands.test import test
from coupler.commands.verify.arguments import verify
from coupler.commands.view.arguments import render
from coupler.commands.watch.arguments import watch
from coupler.program.failures import Failures

PASS_ON = {"allow_extra_args": True, "ignore_unknown_options": True}
"""Settings of a command that hands its words to another program."""

COMMANDS = (
    (run, {}),
    (watch, {}),
    (resume, {}),
    (check, {}),
    (render, PASS_ON | {"help_option_names": []}),
    (report, {}),
    (diff, {}),
    (export, {}),
    (doctor, {}),
    (explain, {}),
    (blocks, {}),
    (terrain, {}),
    (offshore, {}),
    (schema, {}),
    (kernels, {}),
    (docs, {}),
    (init, {}),
    (verify, {}),
    (stress, {}),
    (compare, {}),
    (study, {}),
    (sweep, {}),
    (benchmark, {}),
    (test, PASS_ON),
)
"""The functions of the commands and their settings, in the order of the help; each has the name of its command."""


class Commands(TyperGroup):
    """All commands; Ctrl-C ends each of them with a message and the exit code of a stop."""

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            with Failures():
                raise


app = typer.Typer(
    cls=Commands,
    name="surgebreak",
    help="How a structure breaks when water hits it, and how its debris then changes the flow.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _function, _settings in COMMANDS:
    app.command(context_settings=_settings)(_function)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
) -> None:
    if version:
        from coupler.program.provenance import version as number

        print(f"surgebreak {number()}")
        raise typer.Exit


def main() -> None:
    """Entry point. Exit codes: 0 done, 1 failure, 2 bad case, 3 diverged or out of balance, 4 stopped."""
    with Failures():
        try:
            app()
        finally:
            _write_out()


def _write_out() -> None:
    """Write what is still held back: where nobody reads any more, end as quietly as other commands do."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
