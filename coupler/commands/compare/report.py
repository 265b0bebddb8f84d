"""The comparison as a table for people, as CSV and as JSON."""

from __future__ import annotations

import csv
from pathlib import Path

from coupler.commands.compare.outcome import KINDS, Exact, Outcome, errors
from coupler.commands.compare.plan import Plan, general_limits
from coupler.program import provenance
from coupler.run.directory import write_json
from yade_scripts.stock.script import StockLaw

COLUMNS = (
    ("law", ""),
    ("substep", "s"),
    ("peak_force", "N"),
    ("peak_force_error", "-"),
    ("dissipated", "J"),
    ("dissipated_error", "-"),
    ("curve_error", "-"),
    ("joints_broken", "-"),
    ("substeps", "-"),
    ("cpu_seconds", "s"),
    ("us_per_substep", "us"),
    ("us_per_joint_substep", "us"),
    ("not_matched", ""),
)
"""Columns of comparison.csv with their units."""


def rows(outcomes: list[Outcome], exact: dict[str, Exact]) -> list[dict]:
    """One row of COLUMNS an outcome; errors against the exact answer, or the reference law where there is none."""
    return [_row(o, errors(o, outcomes[0], exact)) for o in outcomes]


def _row(o: Outcome, wrong: dict[str, float]) -> dict:
    return {
        "law": o.law.name,
        "substep": o.figures["substep"],
        "peak_force": o.peak_force,
        "peak_force_error": wrong["peak_force"],
        "dissipated": o.dissipated,
        "dissipated_error": wrong["dissipated"],
        "curve_error": wrong["curve"],
        "joints_broken": o.broken,
        "substeps": o.figures["substeps"],
        "cpu_seconds": o.cpu_seconds,
        "us_per_substep": o.us_per_substep,
        "us_per_joint_substep": o.us_per_joint,
        "not_matched": "; ".join(o.law.not_matched),
    }


def write(plan: Plan, outcomes: list[Outcome], exact: dict[str, Exact], folder: Path) -> list[dict]:
    """comparison.csv and comparison.json in a folder; returns the rows."""
    found = rows(outcomes, exact)
    with (folder / "comparison.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in COLUMNS])
        writer.writerows([f"{v:.9g}" if isinstance(v, float) else v for v in row.values()] for row in found)
    content = {
        "case": str(plan.file.path),
        "overrides": list(plan.file.overrides),
        "reference": plan.laws[0].name,
        "exact": {kind: {"value": e.value, "source": e.source} for kind, e in exact.items()},
        "not_matched_by_any_stock_law": general_limits(plan.file),
        "laws": [
            row
            | {
                "multiple": o.multiple,
                "files": _place(o),
                "joints": o.figures["joints"],
                "stock": isinstance(o.law, StockLaw),
                "largest_error": errors(o, outcomes[0], exact)["largest"],
            }
            for row, o in zip(found, outcomes)
        ],
        "machine": provenance.machine(),
        "versions": provenance.versions(),
    }
    write_json(folder / "comparison.json", content)
    return found


def _place(o: Outcome) -> str:
    return f"{'laws' if o.multiple == 1 else f'substeps-{o.multiple}'}/{o.law.stem}"


SHOWN = (
    ("law", "{}"),
    ("peak_force", "{:.5g}"),
    ("peak_force_error", "{:.2%}"),
    ("dissipated", "{:.5g}"),
    ("dissipated_error", "{:.2%}"),
    ("curve_error", "{:.1%}"),
    ("joints_broken", "{}"),
    ("cpu_seconds", "{:.3g}"),
    ("us_per_substep", "{:.3g}"),
    ("us_per_joint_substep", "{:.3g}"),
    ("not_matched", "{}"),
)
HEADS = (
    "law",
    "peak N",
    "error",
    "dissipated J",
    "error",
    "curve",
    "broken",
    "CPU s",
    "us/substep",
    "us/joint",
    "not matched",
)


MEANINGLESS = 1e3
"""An error above this is one against round-off: nothing was driven, or nothing was lost."""


def _cell(value, form: str) -> str:
    """A cell of the table; a dash for errors that are not defined."""
    if form.endswith("%}") and not abs(value) < MEANINGLESS:
        return "-"
    return form.format(value)


def table(plan: Plan, outcomes: list[Outcome], found: list[dict], exact: dict[str, Exact]) -> str:
    """For the terminal: the runs at the case's own substep, and what the errors are against."""
    cells = [HEADS] + [
        tuple(_cell(row[name], form) for name, form in SHOWN)
        for row, o in zip(found, outcomes)
        if o.multiple == plan.substeps[0]
    ]
    widths = [max(len(line[c]) for line in cells) for c in range(len(HEADS) - 1)]
    lines = [
        "  ".join(
            [line[0].ljust(widths[0]), *(t.rjust(w) for t, w in zip(line[1:-1], widths[1:])), line[-1]]
        ).rstrip()
        for line in cells
    ]
    if plan.file.overrides and (plan.file.directory / "expected.toml").exists():
        lines.append(
            "the exact results of expected.toml are those of the case without --set, and are left out"
        )
    for kind in KINDS:
        against = f"{exact[kind].value:g} ({exact[kind].source})" if kind in exact else f"{plan.laws[0].name}"
        lines.append(f"error of {kind.replace('_', ' ')}: against {against}")
    lines.append(f"curve: L2 distance of force over displacement from {plan.laws[0].name}")
    lines += [f"no stock law matches: {limit}" for limit in general_limits(plan.file)]
    return "\n".join(lines)
