"""The directory of a sweep.

sweep.json         what is varied and measured, every row and run, as the last call planned it
runs/ID/           run directory of a run            runs/ID.log   what its process printed
runs/ID.json       how it ended, what it cost, its numbers; there when it would end the same way again
runs/ID.open.json  the same of a run that was stopped, killed or crashed: the next call goes on with it
table.csv, table.parquet, fragility.json, sensitivity.json, report.html, figures
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from coupler.case.paths import BadPath, read_text
from coupler.case.sweep import Sweep
from coupler.commands.sweep.plan import Column, Plan, Row
from coupler.program.errors import NoRun
from coupler.run.directory import write_json

NAME = "sweep.json"
LAYOUT = 1


@dataclass(frozen=True)
class Spec:
    """What sweep.json says. runs: overrides by id; threads: of each run."""

    folder: Path
    title: str
    case_file: Path
    sweep: Sweep
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    runs: dict[str, tuple[str, ...]]
    remarks: tuple[str, ...]
    threads: int
    case: dict

    def place(self, id: str) -> Path:
        """Run directory of a run."""
        return self.folder / "runs" / id


def spec_of(folder: Path, plan: Plan, threads: int) -> Spec:
    """What a sweep in a directory would be by this plan; nothing is written."""
    return Spec(
        folder=folder.resolve(),
        title=plan.file.case.case.title,
        case_file=plan.file.path.resolve(),
        sweep=plan.sweep,
        columns=plan.columns,
        rows=plan.rows,
        runs=plan.runs,
        remarks=plan.remarks,
        threads=threads,
        case=next(iter(plan.cases.values())),
    )


def write_spec(folder: Path, plan: Plan, threads: int) -> Spec:
    """Write what is planned into the directory, which is made. Runs that are being made there read it again and again,
    so no other plan may take its place until they are done."""
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    spec = spec_of(folder, plan, threads)
    content = {
        "layout": LAYOUT,
        "title": spec.title,
        "case_file": str(spec.case_file),
        "sweep": spec.sweep.model_dump(mode="json", exclude_none=True),
        "columns": [asdict(column) for column in spec.columns],
        "rows": [asdict(row) for row in spec.rows],
        "runs": {id: list(overrides) for id, overrides in spec.runs.items()},
        "remarks": list(spec.remarks),
        "threads": threads,
        "case": spec.case,
    }
    write_json(folder / NAME, content)
    return read_spec(folder)


def read_spec(folder: Path) -> Spec:
    """What a sweep in a directory is.  Raises NoRun."""
    path = folder / NAME
    try:
        stored = json.loads(read_text(path))
        return Spec(
            folder=folder.resolve(),
            title=stored["title"],
            case_file=Path(stored["case_file"]),
            sweep=Sweep.model_validate(stored["sweep"]),
            columns=tuple(Column(**{**c, "keys": tuple(c["keys"])}) for c in stored["columns"]),
            rows=tuple(Row(**row) for row in stored["rows"]),
            runs={id: tuple(overrides) for id, overrides in stored["runs"].items()},
            remarks=tuple(stored["remarks"]),
            threads=stored["threads"],
            case=stored["case"],
        )
    except BadPath as error:
        raise NoRun(f"{folder}: not the directory of a sweep: {error}") from error
    except (LookupError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise NoRun(f"{path}: not what a sweep writes: {error!r}") from error


def figures(spec: Spec, id: str) -> dict[str, Any] | None:
    """How a run ended; None where it has not ended yet or this is unknown."""
    return ended(spec, id) or _read(_open(spec, id))


def ended(spec: Spec, id: str) -> dict[str, Any] | None:
    """How a run ended that need not be made again; None for any other."""
    return _read(spec.folder / "runs" / f"{id}.json")


def write_figures(spec: Spec, id: str, found: dict, final: bool) -> None:
    """Write how a run ended; final: it would end in the same way if it were repeated."""
    write_json(spec.folder / "runs" / f"{id}.json" if final else _open(spec, id), found)
    if final:
        _open(spec, id).unlink(missing_ok=True)


def _open(spec: Spec, id: str) -> Path:
    return spec.folder / "runs" / f"{id}.open.json"


def _read(path: Path) -> dict | None:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):  # absent, or incomplete after a crash of the machine
        return None


def number(value) -> float:
    """A number of a JSON file, where null stands for NaN."""
    return math.nan if value is None else float(value)
