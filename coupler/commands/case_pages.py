"""Compares the figures that the pages of cases state with runs of these cases, and renews them.

`python -m coupler.commands.case_pages CASE...` runs each case as it is written and prints for each figure of its README
that `expected.toml` names ([[stated]]) what the page states, what the run gives, their difference and its tolerance.
In place of a case, the directory of a finished run may be named. With `--write`, figures beyond their tolerance are
renewed. The exit code is 3 if there were any, or if a run failed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from coupler.checks.read_case import load
from coupler.program.errors import BadCase, ExitCode
from coupler.program.failures import Failures
from coupler.program.process import run_module, trouble
from coupler.results.stated import Stated, places, renew, stated
from coupler.run.summary import FILE_NAME, read_summary

ROW = "{:28} {:>10} {:>10} {:>10} {:>10}  {:8}{}"


def compare(place: Path, write: bool = False) -> bool:
    """Print the figures of a case, or of a finished run of it; whether all are within their tolerances.

    Raises BadCase where the page lacks a figure, or the run is not of the case as it is written."""
    if (place / FILE_NAME).exists():
        return _against(_case_of(place), place, write)
    case = load(place).directory
    page = case / "README.md"
    if not page.exists() or not places(case, page.read_text(encoding="utf-8")):
        print(f"{case.name}: expected.toml names no figures of a README.md ([[stated]])")
        return True
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        done = run_module(
            "coupler.commands.cli", "run", case, "--output", run, capture_output=True, text=True
        )
        if done.returncode != ExitCode.DONE:
            print(f"{case.name}: {trouble(done.returncode, done.stderr or done.stdout)}")
            return False
        return _against(case, run, write)


def _case_of(run: Path) -> Path:
    summary = read_summary(run)
    if summary["overrides"] or summary["status"] != "done":
        raise BadCase([f"{run}: not a finished run of the case as it is written"])
    return load(Path(summary["case_file"])).directory


def _against(case: Path, run: Path, write: bool) -> bool:
    found = stated(case, run)
    for one in found:
        print(_row(case.name, one), flush=True)
    if write:
        page = case / "README.md"
        page.write_text(renew(page.read_text(encoding="utf-8"), found), encoding="utf-8")
    return all(one.kept for one in found)


def _row(case: str, one: Stated) -> str:
    if one.reason:
        return f"{case:28} {one.reason}: {one.text}"
    difference = one.now - float(one.stated)
    words = ("" if one.kept else "DIFFERS", one.text)
    return ROW.format(case, one.stated, *(f"{x:.5g}" for x in (one.now, difference, one.tolerance)), *words)


def main() -> ExitCode:
    """The command line."""
    line = argparse.ArgumentParser(prog="python -m coupler.commands.case_pages", description=__doc__)
    line.add_argument("places", nargs="+", type=Path, metavar="CASE", help="a case, or a finished run of it")
    line.add_argument("--write", action="store_true", help="renew figures beyond their tolerance")
    words = line.parse_args()
    print(ROW.format("case", "page", "run", "difference", "tolerance", "", "figure"))
    kept = [compare(place, words.write) for place in words.places]
    return ExitCode.DONE if all(kept) else ExitCode.DIVERGED


if __name__ == "__main__":
    with Failures():
        sys.exit(main())
