"""Results as a table that grows case by case, with totals, and as JSON, one object per line."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path

from coupler.commands.pictures import figures
from coupler.commands.verify.registry import NOT_COVERED, Check, Result
from coupler.commands.verify.runner import chosen, run
from coupler.program.errors import ExitCode

HEAD = ("case", "quantity", "value", "expected", "error", "limit", "", "cpu s")
FORM = "{:5} {:73} {:>12} {:>12} {:>9} {:>8} {:8} {:>7}"


def verify(
    ids: list[str], quick: bool, as_json: bool, only_list: bool, plots: Path | None = None
) -> ExitCode:
    """Run the cases asked for and print each result as it comes; DIVERGED if one did not pass.

    plots: a folder for figures that compare computed with measured curves, where a case has any."""
    cases = chosen(ids, quick)
    if only_list:
        print(listing(cases))
        return ExitCode.DONE
    if plots is not None:
        plots.mkdir(parents=True, exist_ok=True)
    if not as_json:
        print(head())
    results = []
    for case in cases:
        for result in run(case, plots):
            results.append(result)
            print(json_line(result) if as_json else line(result), flush=True)
    if not as_json:
        print(totals(results))
    if plots is not None:
        draw(plots, [case.id for case in cases])
    return ExitCode.DONE if not any(r.missed for r in results) else ExitCode.DIVERGED


def draw(plots: Path, ids: list[str]) -> None:
    """Draw the figures that the cases left, in a process of its own, and list the pictures on stderr."""
    there = [str(path) for id in ids if (path := plots / f"{id}.json").exists() and path.stat().st_size]
    if there:
        reason = figures("coupler.commands.view.curves", plots, *there, stdout=sys.stderr)
        if reason:
            print(f"no figures: {reason}", file=sys.stderr)


def head() -> str:
    """Heading of the table."""
    return FORM.format(*HEAD)


def line(result: Result) -> str:
    """One row; for a case that ended prematurely it gives the reason in place of the values."""
    verdict = "reported" if not result.judged else "ok" if result.passed else "FAIL"
    if result.value is None:
        return f"{result.id:5} {verdict}: {result.reason}"
    error, limit = (_share(v) if result.relative else f"{v:.3g}" for v in (result.error, result.tolerance))
    values = (f"{result.value:.6g}", f"{result.expected:.6g}", error, limit)
    return FORM.format(result.id, result.quantity, *values, verdict, f"{result.cpu_s:.1f}")


def json_line(result: Result) -> str:
    """One object a quantity."""
    row = asdict(result)
    row["pass"] = row.pop("passed")
    return json.dumps(row)


def totals(results: list[Result]) -> str:
    """How many passed, which did not, and the processor time."""
    failed = sorted({r.id for r in results if r.missed})
    cases = len({r.id for r in results})
    judged = [r for r in results if r.judged]
    summary = f"{cases - len(failed)} of {cases} cases pass, {sum(r.passed for r in judged)} of {len(judged)} figures"
    if failed:
        summary += f"; not: {', '.join(failed)}"
    return f"{summary}; {sum(r.cpu_s for r in results):.1f} CPU s"


def listing(cases: list[Check]) -> str:
    """Every case with its source and cost, then the checks that are not covered, if any, and the reason."""
    rows = [f"{c.id:5} {c.group:8} {c.cost}  {c.title} [{c.source}]" for c in cases]
    if NOT_COVERED:
        rows += ["", "not covered:", *(f"{id:5} {why}" for id, why in NOT_COVERED.items())]
    return "\n".join(rows)


def _share(value: float) -> str:
    return f"{100 * value:.3g} %"
