"""Writes the tables of docs/stress.md: `surgebreak stress --json | python -m coupler.commands.stress.page`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable

HEAD = "| scene | what | verdict | CPU s |\n|---|---|---|---|"


def tables(rows: list[dict]) -> str:
    """One table a group; below it the messages of refused scenes and the limits that failed ones exceeded."""
    groups = list(dict.fromkeys(row["group"] for row in rows))
    return "\n\n".join(_group(name, [row for row in rows if row["group"] == name]) for name in groups) + "\n"


def _group(name: str, rows: list[dict]) -> str:
    spent = sum(row["cpu_s"] for row in rows)
    counts = {v: sum(row["verdict"] == v for row in rows) for v in ("passed", "refused", "failed")}
    message = ", ".join(f"{number} {verdict}" for verdict, number in counts.items() if number)
    lines = "\n".join(_row(row) for row in rows)
    below = "\n".join(line for row in rows for line in _below(row))
    return f"### {name}\n{message}; {spent:.0f} CPU s.\n\n{HEAD}\n{lines}" + (f"\n\n{below}" if below else "")


def _row(row: dict) -> str:
    verdict = row["verdict"] if row["verdict"] != "failed" else "**failed**"
    return f"| {row['id']} | {row['title']} | {verdict} | {row['cpu_s']:.1f} |"


def _below(row: dict) -> Iterable[str]:
    missed = [m for m in row["measures"] if not m["kept"]]
    said = [f"{m['quantity']} {m['value']:.2g}, limit {m['limit']:.2g}" for m in missed]
    if row["verdict"] == "refused" or (row["verdict"] == "failed" and row["message"]):
        said.append(f"“{row['message']}”")
    if row["verdict"] != "passed" and said:
        yield f"- {row['id']}: {'; '.join(said)}"


def main() -> None:
    """Read outcomes, one JSON object a line, and print the tables."""
    print(tables([json.loads(line) for line in sys.stdin if line.strip()]), end="")


if __name__ == "__main__":
    main()
