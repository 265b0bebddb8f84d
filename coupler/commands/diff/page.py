"""The comparison of runs as JSON and as an HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any

from coupler.commands.diff.case import Change
from coupler.commands.diff.figures import Row, Run
from coupler.commands.diff.table import notes, same_case
from coupler.commands.report.html import document, facts, figure, note, paragraph, section, table

CURVES = "curves"
"""Stem of the figures with the histories."""
TITLE = "Runs side by side"


def content(
    runs: Sequence[Run], changed: Sequence[Change], rows: Sequence[Row], curves: Sequence[str]
) -> dict[str, Any]:
    """The comparison as plain data, in SI."""
    return {
        "runs": [
            {
                "label": run.label,
                "path": str(run.path.resolve()),
                "title": run.summary["case"]["case"]["title"],
                "status": run.status,
                "overrides": run.summary["overrides"],
            }
            for run in runs
        ],
        "case": [{"key": c.key, "unit": c.unit, "values": list(c.values)} for c in changed],
        "figures": [
            {
                "section": row.section,
                "what": row.what.strip(),
                "unit": "1" if row.unit == "%" else row.unit,
                "values": list(row.values),
                "relative": [row.relative(value) for value in row.values],
            }
            for row in rows
        ],
        "curves": list(curves),
        "notes": notes(runs),
    }


def page(
    runs: Sequence[Run], changed: Sequence[Change], rows: Sequence[Row], folder: Path, remark: str
) -> str:
    """The page. folder: of the figures · remark: why there are none."""
    head = ["", *(run.label for run in runs)]
    texts = range(len(head))
    of_case = table(["key of the case", *head[1:]], [[c.key, *c.words()] for c in changed], texts)
    drawn = sorted(folder.glob(f"{CURVES}*.png"))
    return document(
        TITLE,
        [
            f"<h1>{escape(TITLE)}</h1>",
            facts([(run.label, f"{run.path.resolve()}: {_title(run)}") for run in runs]),
            *(note(line) for line in notes(runs)),
            section("What differs in the case", of_case or paragraph(f"{same_case(runs).capitalize()}.")),
            *(
                section(
                    name.capitalize(), table(head, [[row.what.strip(), *row.words()] for row in group], texts)
                )
                for name, group in groupby(rows, key=lambda row: row.section)
            ),
            section("Histories", *(figure(path, "Histories of the runs") for path in drawn), note(remark)),
        ],
    )


def _title(run: Run) -> str:
    return str(run.summary["case"]["case"]["title"])
