"""The value of a quantity in a run: a column with a reduction, or a figure of run.json."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from array_types import Array
from coupler.case.study import Quantity
from coupler.program.errors import BadCase, SurgebreakError, did_you_mean
from coupler.results.expected import lacking, reduced, windowed
from coupler.results.history import read_history
from coupler.run.summary import read_summary


class NotRecorded(SurgebreakError):
    """A curve does not have all of the time that a quantity is about; the message says what is missing."""


@dataclass(frozen=True)
class Curve:
    """time (n,) [s], increasing · values (n,)"""

    time: Array
    values: Array

    def within(self, window: tuple[float, float] | None) -> Curve:
        """The part between two times, including its ends; the whole curve without a window. Raises NotRecorded."""
        if window is None:
            return self
        if missing := lacking(self.time, *window):
            raise NotRecorded(f"there is nothing {missing}")
        return Curve(*windowed(self.time, self.values, *window))


def curve(run: Path, q: Quantity, place: str) -> Curve:
    """The column of a quantity over time. Raises BadCase, naming the nearest table or column there is."""
    path = run / q.table
    if not path.exists():
        there = [f"history/{found.name}" for found in sorted((run / "history").glob("*.csv"))]
        raise BadCase(
            [f"{place}: table '{q.table}': no such history{did_you_mean(q.table, there)}{_there(there)}"]
        )
    columns = read_history(path).values
    if q.column not in columns:
        known = [name for name in columns if name != "time"]
        raise BadCase(
            [f"{place}: {q.table} has no column '{q.column}'{did_you_mean(q.column, known)}{_there(known)}"]
        )
    return Curve(columns["time"], columns[q.column])


def _there(names: list[str]) -> str:
    return f"; there are {', '.join(names)}" if names else ""


def taken(q: Quantity, found: Curve) -> float:
    """The reduction of a curve to a number; NaN where it has none (no second swing, a value never passed). Raises
    NotRecorded."""
    entry = {"take": q.take, "time": q.time, "above": q.above}
    if q.window is not None:
        entry |= {"from": q.window[0], "to": q.window[1]}
    value, reason = reduced(found.time, found.values, entry)
    if reason:
        raise NotRecorded(reason)
    return value


def read(run: Path, q: Quantity, place: str) -> float:
    """The number of a quantity in a run, for any take but `curve`. Raises BadCase, NotRecorded."""
    return _figure(run, q, place) if q.figure is not None else taken(q, curve(run, q, place))


def _figure(run: Path, q: Quantity, place: str) -> float:
    """A figure of run.json; dots lead into tables: cpu_seconds.water."""
    found, figures = read_summary(run)["figures"], None
    for name in q.figure.split("."):
        figures = found
        if not isinstance(figures, dict) or name not in figures:
            known = list(figures) if isinstance(figures, dict) else []
            raise BadCase(
                [f"{place}: run.json has no figure '{q.figure}'{did_you_mean(name, known)}{_there(known)}"]
            )
        found = figures[name]
    if isinstance(found, bool) or not isinstance(found, int | float):
        inside = [f"{q.figure}.{name}" for name in found] if isinstance(found, dict) else []
        raise BadCase([f"{place}: figure '{q.figure}' of run.json is no number{_there(inside)}"])
    return float(found)
