"""What is printed for people: messages, tables, and lines that survive a pipe."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rich.console import Console


class Row(NamedTuple):
    """One line of a table: what, its value, the unit, and what to know about it."""

    name: str
    value: str | float | int
    unit: str = ""
    remark: str = ""


@lru_cache(maxsize=1)
def console() -> Console:
    """The terminal for results and progress (standard output)."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=not sys.stdout.isatty())


def error(text: str) -> None:
    """Each line of a message on standard error, the first marked with the program's name."""
    print(f"surgebreak: {text}", file=sys.stderr, flush=True)


def table(title: str, rows: Iterable[Row]) -> None:
    """A table of rows; without a terminal, aligned plain lines."""
    rows = [Row(*row) for row in rows]
    if not console().is_terminal:
        _plain(title, rows)
        return
    from rich.table import Table

    grid = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for is_number in (False, True, False, False):
        grid.add_column(justify="right" if is_number else "left")
    for row in rows:
        grid.add_row(row.name, number(row.value), row.unit, row.remark)
    console().print(grid)


def _plain(title: str, rows: list[Row]) -> None:
    print("\n  ".join([title, *lines(rows)]))


def lines(rows: Iterable[Row]) -> list[str]:
    """The rows as aligned plain lines."""
    rows = list(rows)
    width = max((len(row.name) for row in rows), default=0)
    return [f"{row.name:{width}}  {number(row.value)} {row.unit}  {row.remark}".rstrip() for row in rows]


def number(value: str | float | int) -> str:
    """Four digits are enough for reading."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def newtons(force: float) -> str:
    """A force [N] in N, kN or MN, to the tenth of a newton."""
    for unit, size in (("MN", 1e6), ("kN", 1e3)):
        if force >= size:
            return f"{force / size:.4g} {unit}"
    return f"{force:.1f} N"


def duration(seconds: float) -> str:
    """42 s, 3 min 05 s, 2 h 10 min."""
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
