"""The command `surgebreak study`: plan, runs, errors, tables, figures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from coupler.commands.pictures import draw
from coupler.commands.study.laws import law_points
from coupler.commands.study.page import page
from coupler.commands.study.plan import make_plan
from coupler.commands.study.report import content, write
from coupler.commands.study.results import collect
from coupler.commands.study.runner import Runs
from coupler.program.errors import ExitCode


def study(
    case: Path,
    ladders: Iterable[str],
    repeat: int | None,
    output: Path | None,
    larger: bool,
    any_version: bool,
) -> ExitCode:
    """Make the study of a case in its directory and print its tables; exits with DIVERGED if a run failed.

    Runs that are done stay: a study that was stopped (STOPPED) goes on, larger rungs are added to it. Raises BadCase.
    """
    plan = make_plan(case, ladders, larger)
    folder = output or plan.file.directory / "runs" / "study"
    runs = Runs(plan, folder, any_version, lambda text: print(text, flush=True))
    try:
        found = collect(plan, runs, repeat or plan.study.repeat)
        found_study = content(plan, runs, found, law_points(plan, runs))
    except KeyboardInterrupt:
        print(
            f"stopped by Ctrl-C; the runs that were done are kept in {folder}, and the same command goes on"
        )
        return ExitCode.STOPPED
    write(folder, found_study)
    print(page(found_study))
    draw("coupler.commands.view.study", folder)
    print(f"results in {folder}")
    return ExitCode.DIVERGED if any(outcome.run.failed for outcome in found.values()) else ExitCode.DONE
