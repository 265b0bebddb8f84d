"""The command `surgebreak compare`: plan, runs, table, files and figure in one directory."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from coupler.commands.compare.outcome import exact_answers
from coupler.commands.compare.plan import make_plan
from coupler.commands.compare.report import table, write
from coupler.commands.compare.run import run_plan
from coupler.commands.pictures import draw
from coupler.program.errors import BadCall, ExitCode
from coupler.run.directory import RunDirectory
from yade_scripts.joints import laws as own_laws
from yade_scripts.stock.script import stock_law, stock_names


def compare(
    case: Path, laws: str, overrides: Iterable[str], output: Path | None, substeps: str, records: int
) -> ExitCode:
    """Compare laws on a case and print where the results are. Raises BadCase, and the errors of the runs."""
    plan = make_plan(case, overrides, _words(laws), _multiples(substeps), records)
    stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    with RunDirectory.create(
        plan.file, output or plan.file.directory / "runs" / f"compare-{stamp}"
    ) as directory:
        outcomes = run_plan(plan, directory.path, lambda text: _tell(directory, text))
        exact = exact_answers(plan.file)
        rows = write(plan, outcomes, exact, directory.path)
        print(table(plan, outcomes, rows, exact))
        draw("coupler.commands.view.comparison", directory.path)
    print(f"results in {directory.path}; each script in laws/ runs alone: yade -x -n SCRIPT")
    return ExitCode.DONE


def show_laws() -> ExitCode:
    """Print all laws, with the properties that the stock laws do not match."""
    for name in own_laws.names():
        print(f"{name}: ours; as joints.law in a case too")
    for name in stock_names():
        law = stock_law(name)
        print(f"{name}: YADE's {law.module.LAW2}; not matched: {'; '.join(law.not_matched)}")
    return ExitCode.DONE


def _tell(directory: RunDirectory, text: str) -> None:
    directory.log(text)
    print(text, flush=True)


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _multiples(text: str) -> list[int]:
    found = _words(text)
    wrong = [word for word in found if not word.isdecimal() or not 1 <= int(word) <= 100]
    if wrong or not found:
        raise BadCall([f"--substeps {text}: write whole numbers from 1 to 100, for instance 1,2,4,8"])
    return [int(word) for word in found]
