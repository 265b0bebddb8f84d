"""A study as JSON, as CSV, and as tables for people."""

from __future__ import annotations

import csv
import math
import sys
from dataclasses import asdict
from pathlib import Path

from coupler.commands.study.cheapest import cheapest, parts
from coupler.commands.study.laws import LawPoint
from coupler.commands.study.plan import Plan
from coupler.commands.study.results import Outcome, finest, orders
from coupler.commands.study.runner import Runs
from coupler.program import provenance
from coupler.run.directory import now_text, write_json

COLUMNS = (
    ("ladder", ""), ("curve", ""), ("label", ""), ("size", ""), ("quantity", ""), ("against", ""),
    ("value", ""), ("reference", ""), ("error", ""), ("band", ""), ("cpu_seconds", "s"), ("set_up_seconds", "s"),
    ("start_seconds", "s"), ("compile_seconds", "s"), ("wall_seconds", "s"), ("peak_memory", "B"), ("cells", ""),
    ("wet_cells", ""), ("blocks", ""), ("joints", ""), ("steps", ""), ("substeps", ""), ("passes", ""), ("failed", ""),
)  # fmt: skip
"""Columns of study.csv with their units; a row a run and quantity."""


def content(plan: Plan, runs: Runs, found: dict[str, Outcome], laws: list[LawPoint]) -> dict:
    """The whole study as plain data."""
    return {
        "program": "surgebreak",
        "case": str(plan.file.path),
        "title": plan.file.case.case.title,
        "note": " ".join(plan.study.note.split()),
        "command": ["surgebreak", *sys.argv[1:]],
        "ended": now_text(),
        "machine": provenance.machine(),
        "versions": provenance.versions(),
        "git": provenance.git_state(),
        "first_step": None if runs.first_step is None else asdict(runs.first_step),
        "quantities": [_quantity(plan, q) for q in plan.study.quantity],
        "ladders": [
            {"name": ladder.name, "what": ladder.what or ladder.name} for ladder in plan.study.ladder
        ],
        "runs": {id: _run(plan, id, outcome) for id, outcome in found.items()},
        "points": [_point(rung, found[rung.setting]) for rung in plan.rungs],
        "laws": [asdict(point) for point in laws],
        "base": plan.base,
        "off": plan.off,
        "orders": [asdict(order) for order in orders(plan, found)],
        "cheapest": [asdict(entry) for entry in cheapest(plan, found)],
        "parts": [asdict(part) for part in parts(plan, found)],
    }


def _quantity(plan: Plan, q) -> dict:
    rung = finest(plan, q) if q.against == "finest" else None
    return {
        "name": q.name,
        "what": q.what or q.name.replace("_", " "),
        "unit": q.unit,
        "against": q.against,
        "source": q.source,
        "curve": q.take == "curve",
        "value": q.value,
        "path": q.path,
        "finest": None if rung is None else {"ladder": rung.ladder, "label": rung.label},
    }


def _run(plan: Plan, id: str, outcome: Outcome) -> dict:
    return asdict(outcome.run) | {
        "overrides": list(plan.settings[id].overrides),
        "repeats": list(outcome.repeats),
        "same": outcome.same,
        "readings": {name: asdict(reading) for name, reading in outcome.readings.items()},
    }


def _point(rung, outcome: Outcome) -> dict:
    return asdict(rung) | {
        "cpu_seconds": outcome.run.cpu_seconds,
        "reason": outcome.run.reason,
        "readings": {name: asdict(reading) for name, reading in outcome.readings.items()},
    }


def write(folder: Path, study: dict) -> None:
    """study.json, study.csv and study.md in the folder of a study."""
    write_json(folder / "study.json", study)
    with (folder / "study.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in COLUMNS])
        for point in study["points"]:
            for q in study["quantities"]:
                writer.writerow(
                    [_csv(point, q, study["runs"][point["setting"]], name) for name, _ in COLUMNS]
                )
    from coupler.commands.study.page import page

    (folder / "study.md").write_text(page(study), encoding="utf-8")


def _csv(point: dict, q: dict, run: dict, name: str) -> str:
    reading = point["readings"].get(q["name"], {})
    own = {
        "quantity": q["name"],
        "against": q["against"],
        "failed": point["reason"] or reading.get("why", ""),
    } | reading
    value = next((place[name] for place in (own, point, run, run["size"]) if name in place), "")
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)
