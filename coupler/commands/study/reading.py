"""The value of a quantity in a run: a column with a reduction, or a figure of run.json."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.study import Quantity
from coupler.program.errors import BadCase, did_you_mean
from coupler.results.expected import TAKE
from coupler.results.history import read_history
from coupler.run.summary import read_summary


@dataclass(frozen=True)
class Curve:
    """time (n,) [s], increasing · values (n,)"""

    time: Array
    values: Array

    def within(self, window: tuple[float, float] | None) -> Curve:
        """The part between two times, including its ends; the whole curve without a window."""
        if window is None:
            return self
        low, high = max(window[0], self.time[0]), min(window[1], self.time[-1])
        inner = (self.time > low) & (self.time < high)
        time = np.concatenate([[low], self.time[inner], [high]])
        return Curve(time, np.interp(time, self.time, self.values))


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
    """The reduction of a curve to a number; NaN where it has none (no second swing, a value never passed)."""
    entry = {"time": q.time, "above": q.above}
    part = found.within(q.window)
    if q.window is not None:
        entry |= {"from": part.time[0], "to": part.time[-1]}
    return float(TAKE[q.take](part.time, part.values, entry))


def read(run: Path, q: Quantity, place: str) -> float:
    """The number of a quantity in a run, for any take but `curve`. Raises BadCase."""
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
        raise BadCase([f"{place}: figure '{q.figure}' of run.json is no number"])
    return float(found)
