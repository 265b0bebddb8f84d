"""The record of an inflow: level and velocity over time in a CSV file that a case names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupler.case.paths import BadPath, read_text
from coupler.case.records import repeated
from coupler.program.errors import briefly


class RecordError(ValueError):
    """The table of an inflow cannot be used; the message says why."""


COLUMNS = ("time", "level", "velocity")


def record_columns(path: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns time [s], level [m], velocity [m/s] of a CSV file. Raises RecordError."""
    numbered = _written_lines(path)
    head = [name.strip() for name in numbered[0][1].split(",")] if numbered else []
    twice = repeated(head)
    if twice:
        raise RecordError(f"{path}: the column '{twice}' is there twice; rename or remove one")
    missing = [name for name in COLUMNS if name not in head]
    if missing:
        raise RecordError(
            f"{path}: no column {', '.join(missing)}; its first line must name "
            f"{', '.join(COLUMNS)}, with commas between"
        )
    table = np.array([_numbers(path, n, line, len(head)) for n, line in numbered[1:]]).reshape(-1, len(head))
    if not len(table):
        raise RecordError(f"{path}: no line of numbers below the names of the columns")
    time, level, velocity = (table[:, head.index(name)] for name in COLUMNS)
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        n, later = numbered[back[0] + 2][0], time[back[0] + 1]
        raise RecordError(f"{path}:{n}: times must increase; {later:g} s comes after {time[back[0]]:g} s")
    return time, level, velocity


def _written_lines(path: str) -> list[tuple[int, str]]:
    """Lines with their numbers, without comments and empty ones; a byte-order mark of a spreadsheet is skipped."""
    try:
        text = read_text(Path(path), encoding="utf-8-sig")
    except BadPath as error:
        raise RecordError(f"{path}: {error}") from error
    return [
        (n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip() and not line.startswith("#")
    ]


def _numbers(path: str, n: int, line: str, count: int) -> list[float]:
    """The numbers of line n, finite and one a column. Raises RecordError."""
    entries = line.strip().split(",")
    if len(entries) != count:
        raise RecordError(f"{path}:{n}: {len(entries)} values; every line needs {count}, one a column")
    found = []
    for entry in entries:
        try:
            found.append(float(entry))
        except ValueError:
            raise RecordError(f"{path}:{n}: {briefly(entry.strip())} is not a number") from None
    if not np.isfinite(found).all():
        raise RecordError(f"{path}:{n}: {briefly(line.strip())} is not finite")
    return found
