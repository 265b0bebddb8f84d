"""The figures of several runs: verdict, loads, gauges, accuracy and cost, a value for each run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from array_types import Array
from coupler.program.process import status_of
from coupler.program.quantities import as_said, percent
from coupler.results.history import BadTable, History, by_block, read_history

Value = float | str | None
SHARE, TIME, LENGTH = "%", "s", "m"
LITTLE = 5e-4
"""Relative difference below which two values count as the same."""
ENDS = ("_impulse", "_peak")
"""Columns that grow during a run: their last value counts."""
LAST = ("_covered",)
"""Columns of a gauge that are left out: they say how far to trust another one."""


@dataclass(frozen=True)
class Run:
    """A run that is compared: its directory, what it is called in the tables (A, B, ...), and run.json."""

    path: Path
    label: str
    summary: dict[str, Any]

    @property
    def figures(self) -> dict[str, Any]:
        """Figures of run.json."""
        return dict(self.summary["figures"])

    @property
    def files(self) -> dict[str, str]:
        """Digests of the files that its case names, by their paths; empty for runs of earlier versions."""
        return dict(self.summary.get("files", {}))

    @property
    def verdict(self) -> dict[str, Any]:
        """The verdict; empty without one."""
        return self.figures.get("verdict") or {}

    @property
    def status(self) -> str:
        """How it ended."""
        return status_of(self.summary)

    def history(self, table: str) -> History | None:
        """A history table with at least one row; None without."""
        path = self.path / "history" / f"{table}.csv"
        try:
            found = read_history(path) if path.is_file() else None
        except BadTable:
            return None
        return found if found is not None and len(found["time"]) else None


@dataclass(frozen=True)
class Row:
    """A line of the comparison. section: heading · what, unit ("" of a text) · values by run, None where a run has
    none."""

    section: str
    what: str
    unit: str
    values: tuple[Value, ...]

    def words(self) -> list[str]:
        """The values as a table shows them, each but the first with its relative difference from the first."""
        return [f"{self._word(value)}{self._beside(value)}" for value in self.values]

    def relative(self, value: Value) -> float | None:
        """(value - first)/|first|; None where that has no meaning: of texts, shares, zeros, and values of other
        sign."""
        first = self.values[0]
        if self.unit == SHARE or not isinstance(value, int | float) or not isinstance(first, int | float):
            return None
        return (value - first) / abs(first) if value * first > 0.0 else None

    def _word(self, value: Value) -> str:
        if isinstance(value, str):
            return value
        if self.unit == SHARE:
            return percent(value)
        return as_said(value, self.unit)

    def _beside(self, value: Value) -> str:
        off = self.relative(value)
        if off is None or abs(off) < LITTLE:
            return ""
        return f" ({off:+.1%})" if abs(off) < 10.0 else f" ({off + 1.0:.3g} times)"


def rows(runs: Sequence[Run]) -> list[Row]:
    """All rows that have a value in at least one run."""
    found = [*_outcome(runs), *_bodies(runs), *_loads(runs), *_gauges(runs), *_accuracy(runs), *_cost(runs)]
    return [row for row in found if any(value is not None for value in row.values)]


def _row(section: str, what: str, unit: str, runs: Sequence[Run], value: Callable[[Run], Value]) -> Row:
    return Row(section, what, unit, tuple(value(run) for run in runs))


def _at(table: Any, *names: str) -> Any:
    """A value in nested tables; None where one of them is absent."""
    for name in names:
        if not isinstance(table, dict):
            return None
        table = table.get(name)
    return table


def _outcome(runs: Sequence[Run]) -> Iterator[Row]:
    section = "outcome"
    yield _row(section, "the run", "", runs, lambda run: run.status.replace("_", " "))
    yield _row(section, "reached the time", TIME, runs, lambda run: run.figures.get("time"))
    for what, unit, names in (
        ("verdict", "", ("word",)),
        ("weight out of its place", SHARE, ("weight_out",)),
        ("joints", "1", ("joints",)),
        ("joints broken", "1", ("joints_broken",)),
        ("joined area broken", SHARE, ("area_broken",)),
        ("first break", TIME, ("first_break", "time")),
        ("blocks", "1", ("blocks",)),
        ("blocks that left their place", "1", ("displaced", "blocks")),
        ("the first of them", TIME, ("displaced", "first")),
        ("largest displacement", LENGTH, ("farthest", "way")),
        ("  of the block", "", ("farthest", "block")),
        ("hits of debris", "1", ("hits", "pairs")),
    ):
        yield _row(section, what, unit, runs, lambda run, names=names: _at(run.verdict, *names))  # type: ignore[misc]


def _bodies(runs: Sequence[Run]) -> Iterator[Row]:
    """State and broken joints of each body, where a run has several."""
    found = [{body["name"]: body for body in run.verdict.get("bodies", [])} for run in runs]
    if max(map(len, found), default=0) < 2:
        return
    for name in dict.fromkeys(name for bodies in found for name in bodies):
        yield Row("bodies", name, "", tuple(_of_body(bodies.get(name)) for bodies in found))


def _of_body(body: dict[str, Any] | None) -> str | None:
    if body is None:
        return None
    broken = f", {body['joints_broken']} of {body['joints']} joints broken" if body["joints"] else ""
    return f"{body['word']}{broken}"


def _loads(runs: Sequence[Run]) -> Iterator[Row]:
    section = "largest loads of the water"
    for what, unit, name in (
        ("force with its uplift", "N", "force"),
        ("horizontal force", "N", "horizontal"),
        ("overturning moment", "N m", "moment"),
        ("depth beside it", LENGTH, "depth"),
    ):
        for shown, of, key in ((what, unit, "value"), ("  at", TIME, "time")):
            yield _row(
                section, shown, of, runs, lambda run, path=("largest", name, key): _at(run.verdict, *path)
            )  # type: ignore[misc]
    if not any(run.verdict for run in runs):
        yield _row(
            section, "force on all bodies", "N", runs, lambda run: run.figures.get("largest_water_force")
        )


def _gauges(runs: Sequence[Run]) -> Iterator[Row]:
    tables = dict.fromkeys(
        path.stem
        for run in runs
        for path in sorted((run.path / "history").glob("*.csv"))
        if _is_gauge(path.stem)
    )
    for table in tables:
        read = [_largest_of(run.history(table)) for run in runs]
        section = (
            "gauges, largest values" if table == "gauges" else f"{table.replace('_', ' ', 1)}, largest values"
        )
        for what, unit in dict.fromkeys(key for found in read for key in found):
            yield Row(section, what, unit, tuple(found.get((what, unit)) for found in read))


def _is_gauge(table: str) -> bool:
    return table == "gauges" or table.startswith("loads_")


def _largest_of(history: History | None) -> dict[tuple[str, str], float]:
    """By name and unit the largest size of each number or vector of a table, with the sign of a number; of a place the
    largest distance from where it began. Empty for tables with a row for each block."""
    if history is None or by_block(history) is not None:
        return {}
    found, done = {}, set()
    names = {column.name for column in history.columns}
    for column in history.columns:
        name, stem = column.name, column.name[:-2]
        if name == "time" or name in done or name.endswith(LAST):
            continue
        axes = [f"{stem}_{axis}" for axis in "xyz"]
        is_vector = name.endswith("_x") and names.issuperset(axes)
        values = np.column_stack([history[n] for n in (axes if is_vector else [name])])
        done |= set(axes) if is_vector else {name}
        what = stem if is_vector else name
        size = _size(values, what)
        if size is not None:
            found[what.replace("_", " "), column.unit] = size
    return found


def _size(values: Array, what: str) -> float | None:
    """The value of rows (n, 1) or (n, 3) that counts; None where all are empty."""
    values = values[np.isfinite(values).all(axis=1)]
    if not len(values):
        return None
    if what.endswith(ENDS):
        values = values[-1:]
    if what.endswith("_centre"):
        values = values - values[0]
    sizes = np.linalg.norm(values, axis=1)
    k = int(np.argmax(sizes))
    return float(values[k, 0]) if values.shape[1] == 1 else float(sizes[k])


def _accuracy(runs: Sequence[Run]) -> Iterator[Row]:
    for what, name in (
        ("largest energy error", "largest_energy_error"),
        ("largest volume error", "largest_volume_error"),
        ("largest coupling defect", "largest_defect"),
        ("numerical dissipation", "numerical_dissipation"),
    ):
        yield _row("accuracy", what, SHARE, runs, lambda run, name=name: run.figures.get(name))  # type: ignore[misc]


def _cost(runs: Sequence[Run]) -> Iterator[Row]:
    section = "cost"
    yield _row(section, "cells", "1", runs, lambda run: _at(run.figures, "size", "cells"))
    yield _row(section, "steps", "1", runs, lambda run: run.figures.get("steps"))
    yield _row(section, "substeps of the blocks", "1", runs, lambda run: run.figures.get("substeps") or None)
    yield _row(section, "processor time", TIME, runs, lambda run: run.summary.get("cpu_seconds"))
    versions = _row(section, "version", "", runs, _version)
    if len(set(versions.values)) > 1:
        yield versions


def _version(run: Run) -> str:
    """Version of the program, with the commit of a checkout."""
    git = run.summary.get("git") or {}
    commit = str(git.get("commit", ""))[:8]
    return (
        f"{run.summary['versions'].get('surgebreak', '')} {commit}{'+' if git.get('changed') else ''}".strip()
    )
