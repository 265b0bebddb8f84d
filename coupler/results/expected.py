"""Comparison of `expected.toml`, the values that a case promises, with the histories of a run directory.

[[expect]]
what = "..."           for people                    table, column   of the history
take = "last"          last | largest (by size, sign kept) | max | min | mean | at (time) | integral (from, to) |
                       period | arrival (above): first time that the column exceeds a value, on a line between two rows
from, to               of that part of the history alone, whatever is taken; there is no value where the run has not
                       recorded all of it, but for a row at its ends, nor at a time outside of what it recorded
value, tolerance       |taken - value| ≤ tolerance   or at_least = / at_most =
source = "..."         where the number comes from
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.program.errors import did_you_mean
from coupler.results.history import read_history


@dataclass(frozen=True)
class Verdict:
    """One promise: the expected value and the value of the run."""

    what: str
    found: float
    expected: str
    kept: bool
    reason: str = ""
    """Why there is nothing to compare."""

    def __str__(self) -> str:
        return f"{self.what}: {self.reason or f'{self.found:.4g}'}, expected {self.expected}"


def verdicts(run: Path, expected: Path) -> list[Verdict]:
    """Compare a run directory with an expected.toml, whose entries are sound (`promises.py`)."""
    entries = tomllib.loads(expected.read_text(encoding="utf-8")).get("expect", [])
    return [_judge(entry, run) for entry in entries]


def _judge(entry: dict, run: Path) -> Verdict:
    exact = "value" in entry
    low, high = entry.get("at_least", -np.inf), entry.get("at_most", np.inf)
    range_text = f"{entry['value']:g} ± {entry['tolerance']:g}" if exact else f"{low:g} to {high:g}"
    found, reason = taken(entry, run)
    if reason:
        return Verdict(entry["what"], float("nan"), range_text, False, reason)
    kept = abs(found - entry["value"]) <= entry["tolerance"] if exact else low <= found <= high
    return Verdict(entry["what"], found, range_text, bool(kept))


def taken(entry: dict, run: Path) -> tuple[float, str]:
    """The value of a run that an entry asks for; NaN with the reason if there is none."""
    columns, reason = _columns(entry, run)
    if reason:
        return float("nan"), reason
    return reduced(columns["time"], columns[entry["column"]], entry)


def reduced(time: Array, values: Array, entry: dict) -> tuple[float, str]:
    """What an entry takes from a history (n,); NaN with the reason where that has not all of what it is about."""
    window = (entry["from"], entry["to"]) if "from" in entry else None
    reason = _without(time, entry["time"]) if entry["take"] == "at" else ""
    if window is not None:
        reason = lacking(time, *window) or reason
    if reason:
        return float("nan"), f"the run has nothing {reason}"
    if window is not None:
        time, values = windowed(time, values, *window)
    return float(TAKE[entry["take"]](time, values, entry)), ""


def _columns(entry: dict, run: Path) -> tuple[dict, str]:
    """The table of a promise, or the reason why no value can be taken from it."""
    table, name = entry["table"], entry["column"]
    if not (run / table).is_file():
        return {}, f"the run has no table {table}"
    columns = read_history(run / table).values
    if name not in columns:
        return {}, f"{table} has no column '{name}'{did_you_mean(name, columns)}"
    return columns, "" if len(columns["time"]) else f"{table} has no rows"


def lacking(time: Array, start: float, end: float) -> str:
    """The part "from ... to ... s" of a window of which a history (n,) [s] has no rows; empty if it has them all."""
    low, high = _covered(time)
    first, last = _recorded(time, start, end)
    if not first < last:
        return f"from {start:g} to {end:g} s"
    if start < low:
        return f"from {start:g} to {first:g} s"
    return f"from {last:g} to {end:g} s" if end > high else ""


def _without(time: Array, at: float) -> str:
    """Why a history (n,) [s] has no value at a time; empty if it has one."""
    low, high = _covered(time)
    return "" if low <= at <= high else f"at {at:g} s, only from {time[0]:g} to {time[-1]:g} s"


def _covered(time: Array) -> tuple[float, float]:
    """Begin and end [s] of what a history tells. The first row of a run is that after its first step, and the last one
    may lie an interval inside."""
    slack = float(np.diff(time).max(initial=0.0))
    return min(0.0, time[0] - slack), time[-1] + slack


def _recorded(time: Array, start: float, end: float) -> tuple[float, float]:
    """Begin and end [s] of the part of a window that a history has."""
    return max(start, time[0]), min(end, time[-1])


def windowed(time: Array, values: Array, start: float, end: float) -> tuple[Array, Array]:
    """The part of a history from start to end [s] that was recorded, with its values there."""
    start, end = _recorded(time, start, end)
    grid = np.unique(np.concatenate([[start, end], time]))
    grid = grid[(grid >= start) & (grid <= end)]
    return grid, np.interp(grid, time, values)


def _integral(time: Array, values: Array, entry: dict) -> float:
    grid, part = windowed(time, values, entry["from"], entry["to"])
    return float(np.trapezoid(part, grid))


def _period(time: Array, values: Array, entry: dict) -> float:
    """Mean distance of upward crossings of the mean [s]; NaN with fewer than two."""
    around = values - values.mean()
    up = np.flatnonzero((around[:-1] < 0) & (around[1:] >= 0))
    crossing = time[up] - around[up] * (time[up + 1] - time[up]) / (around[up + 1] - around[up])
    return np.diff(crossing).mean() if len(crossing) > 1 else np.nan


def _arrival(time: Array, values: Array, entry: dict) -> float:
    return first_above(time, values, entry["above"])


def first_above(time: Array, values: Array, above: float) -> float:
    """First time at which values (n,) exceed `above` [s], on a line between the row before and the first that does;
    NaN if they never do."""
    beyond = values > above
    if not beyond.any():
        return np.nan
    k = int(beyond.argmax())
    if k == 0 or not np.isfinite(values[k - 1]):
        return float(time[k])
    return float(np.interp(above, values[k - 1 : k + 1], time[k - 1 : k + 1]))


TAKE: dict[str, Callable[[Array, Array, dict], float]] = {
    "last": lambda time, values, entry: values[-1],
    "largest": lambda time, values, entry: values[np.abs(values).argmax()],
    "max": lambda time, values, entry: values.max(),
    "min": lambda time, values, entry: values.min(),
    "mean": lambda time, values, entry: np.trapezoid(values, time) / (time[-1] - time[0]),
    "at": lambda time, values, entry: np.interp(entry["time"], time, values),
    "integral": _integral,
    "period": _period,
    "arrival": _arrival,
}
