"""The table of all runs of a sweep: what was varied, seeds, how each run ended, what it cost, its quantities.

`table.csv` says name, unit and meaning of every column in lines that begin with '#'; `table.parquet` holds the same
with the units as attributes, where the extra `parquet` is installed. `table` gives it as a pandas DataFrame.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coupler.case.formula import BadFormula, evaluate
from coupler.case.sweep_names import seed_column
from coupler.commands.sweep.folder import Spec, figures, number, read_spec
from coupler.commands.sweep.one import FINAL
from coupler.commands.sweep.plan import Row
from coupler.commands.sweep.quantities import asked, definition, is_derived, read_quantity
from coupler.program.errors import NoRun
from coupler.program.extras import absent, need
from coupler.results.history import Column, header, line
from coupler.results.history import number as shortest
from coupler.run.summary import read_summary

NUMBERS = re.compile(r"'[^']*'|\d[\d.e+-]*")
"""What differs between runs in one reason to doubt: names and numbers."""
FREE = " (free field)"
"""Suffix of the meaning of a quantity that is taken from the run without structure."""
NOT_YET = "not yet"
"""Outcome of a row whose run has not been made."""


@dataclass(frozen=True)
class Results:
    """columns as declared; records: a dict of them for each row; figures: how each run ended, by its id; lacking: a
    sentence for each quantity that runs which are done have no number of; doubted: one for each reason to doubt the
    loads or the verdict of runs that are done."""

    columns: tuple[Column, ...]
    records: tuple[dict, ...]
    figures: dict[str, dict]
    lacking: tuple[str, ...] = ()
    doubted: tuple[str, ...] = ()

    def column(self, name: str) -> list:
        """The values of a column, row by row."""
        return [record[name] for record in self.records]


def collect(spec: Spec) -> Results:
    """The results of all rows of a sweep so far."""
    found = {id: ended_run for id in _ids(spec) if (ended_run := figures(spec, id)) is not None}
    lacks: dict[str, list[str]] = {}
    records = tuple(_record(spec, row, found, lacks) for row in spec.rows)
    done = sum(record["outcome"] == "done" for record in records)
    lacking = tuple(
        f"{name} has no number in {len(why)} of {done} rows that are done: {why[0]}"
        for name, why in lacks.items()
    )
    return Results(tuple(_columns(spec, found)), records, found, lacking, tuple(_doubted(records, found)))


def _doubted(records: tuple[dict, ...], found: dict[str, dict]) -> Iterator[str]:
    """Reasons to doubt that differ in their numbers alone are one, told by the first row that has it."""
    done = [record for record in records if record["outcome"] == "done"]
    rows: dict[str, list[tuple[int, str]]] = {}
    for record in done:
        for doubt in found[record["id"]].get("doubts", []):
            rows.setdefault(NUMBERS.sub("#", doubt), []).append((record["run"], doubt))
    for cases in rows.values():
        number, doubt = cases[0]
        yield f"{len(cases)} of {len(done)} rows that are done, the first of them row {number}: {doubt}"


def _ids(spec: Spec) -> list[str]:
    return list(dict.fromkeys(id for row in spec.rows for id in (row.id, row.free) if id))


def _columns(spec: Spec, found: dict[str, dict]) -> Iterator[Column]:
    yield Column("run", "1", "number of the row")
    yield Column("point", "1", "point of the grid")
    yield Column("sample", "1", "sample at that point")
    yield Column("repeat", "1", "repeat of that sample, with other seeds")
    for column in spec.columns:
        yield Column(column.name, column.unit or "1", f"{column.what}{_sets(column.keys)}")
    for key in spec.sweep.seeds:
        yield Column(seed_column(key), "1", f"seed: sets {key}")
    for q in asked(spec.sweep):
        free = FREE if q.source == "free field" else ""
        yield Column(
            q.name, q.unit or _found_unit(q.name, found) or "1", f"{q.what or q.name.replace('_', ' ')}{free}"
        )
    yield Column(
        "outcome",
        "",
        f"{', '.join(FINAL)}, or what the next call goes on with: stopped, killed, crashed, {NOT_YET}",
    )
    yield Column("reason", "", "why a run did not reach its end")
    yield Column("cpu_seconds", "s", "processor time")
    yield Column("wall_seconds", "s", "time that passed")
    yield Column("memory", "B", "largest resident memory")
    yield Column("attempts", "1", "processes that it took")
    yield Column("id", "", "of the run, its directory in runs/")


def _found_unit(name: str, found: dict[str, dict]) -> str:
    """The unit that the runs have for a quantity; "" where none has one, as in results of an earlier version."""
    units = (ended_run["readings"].get(name, {}).get("unit", "") for ended_run in found.values())
    return next(filter(None, units), "")


def _sets(keys: tuple[str, ...]) -> str:
    return f": sets {', '.join(keys)}" if keys else ""


def _record(spec: Spec, row: Row, found: dict[str, dict], lacks: dict[str, list[str]]) -> dict:
    ended_run = found.get(row.id, {})
    outcome = "refused" if row.wrong else ended_run.get("outcome", NOT_YET)
    record = {"run": row.number, "point": row.point, "sample": row.sample, "repeat": row.repeat}
    record |= {column.name: row.values[column.name] for column in spec.columns}
    record |= {seed_column(key): value for key, value in row.seeds.items()}
    reasons = [row.wrong or ended_run.get("reason", "")]
    record |= _quantities(spec, row, found, record, reasons, lacks)
    return record | {
        "outcome": outcome,
        "reason": "; ".join(filter(None, dict.fromkeys(reasons))),
        "cpu_seconds": number(ended_run.get("cpu_seconds")),
        "wall_seconds": number(ended_run.get("wall_seconds")),
        "memory": number(ended_run.get("memory")),
        "attempts": ended_run.get("attempts", 0),
        "id": row.id,
    }


def _quantities(
    spec: Spec, row: Row, found: dict, record: dict, reasons: list[str], lacks: dict[str, list[str]]
) -> dict[str, float]:
    """Quantities of a row; `reasons` receives why a completed run lacks one, `lacks` the same by quantity."""
    values: dict[str, float] = {}
    case = None
    for q in asked(spec.sweep):
        id = row.free if q.source == "free field" else row.id
        ended_run = found.get(id)
        if ended_run is None or row.wrong:
            values[q.name] = math.nan
        elif is_derived(q):
            case = _case(spec, row.id) if case is None else case
            numbers = {k: v for k, v in record.items() if isinstance(v, int | float)}
            values[q.name] = _derived(q.formula, case | numbers | values)
        else:
            values[q.name], why = _reading(spec, q, id, ended_run)
            if why and ended_run["outcome"] == "done" and spec.sweep.quantity:
                why = why.removeprefix(f"{q.name}: ")
                reasons.append(f"{q.name}: {why}")
                lacks.setdefault(q.name, []).append(why)
            elif id == row.free and ended_run["outcome"] != "done":
                reasons.append(f"free field: {ended_run['reason']}")
    return values


def _reading(spec: Spec, q, id: str, ended_run: dict) -> tuple[float, str]:
    """Value of a quantity, or why there is none. It is read again if its definition has changed since the run ended."""
    known = ended_run["readings"].get(q.name)
    if known is not None and known["of"] == definition(q):
        return number(known["value"]), known["why"]
    if ended_run["outcome"] in ("refused", "cannot stand"):
        return math.nan, ""
    found = read_quantity(spec.place(id), q)
    return (
        found.value,
        found.why
        and f"{found.why} (it was not asked for when the run was made; keep = 'all' keeps the files)",
    )


def _case(spec: Spec, id: str) -> dict:
    try:
        return read_summary(spec.place(id))["case"]
    except NoRun:
        return spec.case


def _derived(formula: str, names: dict) -> float:
    """NaN where something that the formula needs has no number."""
    try:
        return evaluate(formula, names)
    except BadFormula:
        if any(isinstance(v, float) and math.isnan(v) for v in names.values()):
            return math.nan
        raise


def write_tables(spec: Spec, results: Results) -> list[Path]:
    """table.csv, and table.parquet where the extra `parquet` is installed; their paths."""
    path = spec.folder / "table.csv"
    rows = [line([_cell(record[c.name]) for c in results.columns]) for record in results.records]
    part = path.with_name(".table.csv.part")
    part.write_text(header(f"sweep of {spec.title}", results.columns) + "".join(rows), encoding="utf-8")
    part.replace(path)
    if absent("parquet"):
        return [path]
    frame = as_frame(results)
    frame.to_parquet(path.with_suffix(".parquet"))
    return [path, path.with_suffix(".parquet")]


def _cell(value) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return ""
    return shortest(value) if isinstance(value, int | float) else str(value).replace("\n", " ")


def as_frame(results: Results):
    """A pandas DataFrame of all rows, with `attrs["units"]` and `attrs["meaning"]` by column."""
    import pandas as pd

    frame = pd.DataFrame({c.name: [_plain(v) for v in results.column(c.name)] for c in results.columns})
    frame.attrs["units"] = {c.name: c.unit for c in results.columns}
    frame.attrs["meaning"] = {c.name: c.meaning for c in results.columns}
    return frame


def _plain(value):
    return str(value) if isinstance(value, list | tuple | dict) else value


def open_sweep(folder: Path | str):
    """The table of a sweep in a directory as a pandas DataFrame, with every run that has ended by now.

    `attrs["units"]` has the SI units of its columns. Raises NoRun, NotInstalled (without pandas).
    """
    need("pandas")
    return as_frame(collect(read_spec(Path(folder))))
