"""Runs cases one after the other, each in a process of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from coupler.commands.verify.registry import NOT_COVERED, Check, Result, checks
from coupler.program.errors import BadCall, did_you_mean
from coupler.program.process import rows_of_module

TIME_LIMIT = {"S": 1800, "M": 2 * 3600, "L": 6 * 3600}
"""Wall seconds after which a case counts as failed: far more than its cost, also on a machine with much else to do."""


def chosen(ids: list[str], quick: bool) -> list[Check]:
    """The cases asked for; all without ids; with quick only those of cost S. Raises BadCall for unknown ids, and where
    none is left."""
    known = checks()
    wrong = [_unknown(id, known) for id in ids if id.upper() not in known]
    if wrong:
        raise BadCall(wrong)
    found = [known[id.upper()] for id in ids] if ids else list(known.values())
    left = [case for case in found if case.cost == "S" or not quick]
    if not left:
        raise BadCall([f"--quick leaves out {', '.join(case.id for case in found)}: each takes minutes"])
    return left


def _unknown(id: str, known) -> str:
    if id.upper() in NOT_COVERED:
        return f"{id}: not covered: {NOT_COVERED[id.upper()]}"
    return f"{id}: unknown case{did_you_mean(id.upper(), known) or '.'} `surgebreak verify --list` names all"


def run(case: Check, plots: Path | None = None) -> Iterator[Result]:
    """Results of one case from its own process; a process that failed gives a result with the reason.

    plots: an existing folder for the figures of the case, <id>.json; None: it has none to write."""
    figures = [] if plots is None else [plots / f"{case.id}.json"]
    rows, wrong = rows_of_module("coupler.commands.verify.one", case.id, TIME_LIMIT[case.cost], *figures)
    yield from (Result(**row) for row in rows)
    if wrong or not rows:
        yield Result.failed(case.id, wrong or "the case gave no result", 0.0)
