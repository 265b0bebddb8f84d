"""Ladders of laws: ours and YADE's own at several substeps, from one `surgebreak compare` of the case.

The processor time of these runs is that of stepping alone, on both sides; they have a figure of their own.
"""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from coupler.case.study import Ladder, Quantity
from coupler.commands.study import runner
from coupler.commands.study.plan import Plan, fingerprint
from coupler.commands.study.reference import Reading, against_number, fixed_reference
from coupler.commands.study.runner import Runs
from coupler.program.errors import SurgebreakError
from coupler.program.process import trouble
from coupler.run.directory import write_json
from coupler.run.fingerprint import run_inputs


@dataclass(frozen=True)
class LawPoint:
    """One law at a multiple of the substep [s]."""

    ladder: str
    law: str
    multiple: int
    substep: float
    stock: bool
    cpu_seconds: float
    readings: dict[str, Reading]


class ComparisonFailed(SurgebreakError):
    """`surgebreak compare` ended with an error."""


def law_points(plan: Plan, runs: Runs) -> list[LawPoint]:
    """Points of all ladders of laws; the comparison is made unless it is there. Raises ComparisonFailed."""
    return [point for ladder in plan.laws for point in _points(plan, ladder, runs)]


def _points(plan: Plan, ladder: Ladder, runs: Runs) -> list[LawPoint]:
    comparison = json.loads(_comparison(plan, ladder, runs).read_text(encoding="utf-8"))
    case = plan.settings[plan.base].case
    wanted = [q for q in plan.study.quantity if q.compared and q.against != "finest"]
    return [
        LawPoint(
            ladder.name,
            row["law"],
            row["multiple"],
            row["substep"],
            row["stock"],
            row["cpu_seconds"],
            {q.name: _reading(plan, q, row, case) for q in wanted},
        )
        for row in comparison["laws"]
    ]


def _reading(plan: Plan, q: Quantity, row: dict, case: dict) -> Reading:
    return against_number(q, row[q.compared], fixed_reference(q, case), f"{plan.file.path}: {q.name}")


def _comparison(plan: Plan, ladder: Ladder, runs: Runs) -> Path:
    overrides = (*plan.study.set, *ladder.set)
    case = plan.settings[plan.base].case
    id = fingerprint({"case": case, "ladder": ladder.model_dump(mode="json"), **run_inputs(case)})
    place = runs.folder / f"laws-{ladder.name}-{id}"
    found, made_by = place / "comparison.json", place.with_suffix(".json")
    if found.exists() and made_by.exists() and (runs.any_version or _program(made_by) == runs.program):
        return found
    if place.exists():
        shutil.rmtree(place)  # of a study that was stopped, or of another version
    log = place.with_suffix(".log")
    sets = [word for override in overrides for word in ("--set", override)]
    substeps = ",".join(str(multiple) for multiple in ladder.substeps)
    options = ["--laws", ",".join(ladder.laws), "--substeps", substeps, "--output", str(place)]
    cost = runner.measure(
        [sys.executable, "-m", "coupler.commands.cli", "compare", str(plan.file.path), *options, *sets], log
    )
    if cost.exit_code:
        comparison = log.read_text(encoding="utf-8", errors="replace")
        raise ComparisonFailed(
            f"ladder {ladder.name}: surgebreak compare: {trouble(cost.exit_code, comparison)}"
        )
    runs.tell(f"ladder {ladder.name}: {len(ladder.laws)} laws compared, {cost.cpu_seconds:.3g} CPU s in all")
    write_json(made_by, runs.program)
    return found


def _program(path: Path) -> dict:
    return json.loads(path.read_text(encoding="utf-8"))
