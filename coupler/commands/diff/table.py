"""The comparison of runs as a table for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from coupler.commands.diff.case import Change, compares_contents
from coupler.commands.diff.figures import Row, Run

SAME = "the cases are the same, value by value"
FILES = " (files that they name are compared by their names alone)"


def text(runs: Sequence[Run], changed: Sequence[Change], rows: Sequence[Row]) -> str:
    """Runs with their titles, then the lines of each section under one head."""
    lines = [f"{run.label}  {run.path}: {run.summary['case']['case']['title']}" for run in runs]
    body: list[tuple[str, list[str]]] = [("case", []), *((c.key, c.words()) for c in changed)]
    if not changed:
        body = [(same_case(runs), [])]
    section = ""
    for row in rows:
        if row.section != section:
            section = row.section
            body.append((section, []))
        body.append((row.what, row.words()))
    return "\n".join([*lines, "", *_aligned([run.label for run in runs], body), *notes(runs)])


def _aligned(head: Sequence[str], body: Sequence[tuple[str, list[str]]]) -> Iterator[str]:
    """Lines with their columns one below the other; a line without cells is a heading."""
    cells = [words for _, words in body if words]
    widths = [max(len(line[k]) for line in [head, *cells]) for k in range(len(head))]
    first = max((len(what) for what, words in body if words), default=0) + 2

    def line(what: str, words: Sequence[str]) -> str:
        return "  ".join([what.ljust(first), *(w.ljust(n) for w, n in zip(words, widths))]).rstrip()

    yield line("", head)
    for what, words in body:
        yield line(f"  {what}", words) if words else what


def same_case(runs: Sequence[Run]) -> str:
    """The sentence for runs whose cases do not differ."""
    cases = [run.summary["case"] for run in runs]
    return SAME + ("" if compares_contents(cases, [run.files for run in runs]) else FILES)


def notes(runs: Sequence[Run]) -> list[str]:
    """What limits the comparison: different ends, and the doubts of each run."""
    found = []
    ends = {f"{run.figures.get('time', 0.0):.6g}" for run in runs}
    if len(ends) > 1:
        found.append("note: the runs reached different times; largest values are those until then")
    found += [f"note: {run.label}: {doubt}" for run in runs for doubt in run.figures.get("doubts", [])]
    return found
