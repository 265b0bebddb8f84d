"""The command `surgebreak sweep`: plan, runs wherever they are made, table, curves, report."""

from __future__ import annotations

import contextlib
import fcntl
import re
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coupler.commands import pictures
from coupler.commands.sweep import page
from coupler.commands.sweep.folder import Spec, ended, figures, spec_of, write_spec
from coupler.commands.sweep.forecast import forecast
from coupler.commands.sweep.local import Local, free_cores
from coupler.commands.sweep.one import FINAL
from coupler.commands.sweep.plan import Plan, make_plan
from coupler.commands.sweep.results import NUMBERS, Results, collect, write_tables
from coupler.program import terminal
from coupler.program.errors import BadCall, ExitCode, SurgebreakError
from coupler.program.extras import missing
from coupler.program.quantities import as_said, counted
from coupler.run.fingerprint import differences, program

ENGINES = (
    "local",
    "slurm",
    "dask-pbs",
    "dask-slurm",
    "dask-sge",
    "dask-lsf",
    "dask-oar",
    "dask-htcondor",
    "dask-local",
)
EXPORTS = ("snakemake",)
SHOWN = 12
"""Largest number of rows of a table on the terminal."""


@dataclass(frozen=True)
class SweepRequest:
    """The request of the command line. options: KEY=VALUE for the engine; chunk: runs that a cluster job makes one
    after the other."""

    vary: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    output: Path | None = None
    plan: bool = False
    jobs: int | None = None
    threads: int = 1
    engine: str = "local"
    options: tuple[str, ...] = ()
    chunk: int = 1
    detach: bool = False
    cancel: tuple[str, ...] | None = None
    export: str | None = None
    any_version: bool = False


class Busy(SurgebreakError):
    """Another process is making the runs of this sweep."""

    exit_code = ExitCode.BAD_CASE


def sweep(case: Path, request: SweepRequest) -> ExitCode:
    """Make the runs of a sweep that are still missing, and print the results; return DIVERGED if a run failed, STOPPED
    if runs are left. Raises BadCase, Busy, NotInstalled."""
    _check(request)
    plan = make_plan(case, request.vary, request.set)
    folder = request.output or plan.file.directory / "runs" / "sweep"
    for remark in plan.remarks:
        print(f"note: {remark}")
    if request.plan:
        spec = spec_of(folder, plan, request.threads)
        _show(plan)
        terminal.table(
            "forecast", forecast(spec, request.jobs or free_cores(request.threads), request.engine == "local")
        )
        return ExitCode.DONE
    if request.export:
        from coupler.commands.sweep.snakemake import export

        with _alone(folder):
            print(f"wrote {export(write_spec(folder, plan, request.threads))}")
        return ExitCode.DONE
    if request.cancel is not None:
        from coupler.commands.sweep.slurm import cancel

        print(cancel(spec_of(folder, plan, request.threads), request.cancel))
        return ExitCode.DONE
    with _alone(folder):
        spec = write_spec(folder, plan, request.threads)
        stopped = _make(spec, request)
    return finish(spec, stopped)


def _check(request: SweepRequest) -> None:
    wrong = []
    if request.engine not in ENGINES:
        wrong.append(f"--engine {request.engine}: there are {', '.join(ENGINES)}")
    if request.export is not None and request.export not in EXPORTS:
        wrong.append(f"--export {request.export}: there are {', '.join(EXPORTS)}")
    if request.engine == "local" and (request.options or request.detach or request.chunk != 1):
        wrong.append("--option, --chunk and --detach are for cluster engines; give --engine")
    wrong += [f"--option {o}: write KEY=VALUE" for o in request.options if "=" not in o]
    if wrong:
        raise BadCall(wrong)


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Allow one process at a time to plan and make runs in a directory, which is made, where the file system has
    locks."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise Busy(
                f"{folder}: another call of `surgebreak sweep` makes its runs; wait, or stop that one"
            ) from error
        except OSError:
            print("note: this file system has no locks; see that no other call makes the same runs")
        yield


def _make(spec: Spec, request: SweepRequest) -> bool:
    """Make the missing runs; returns whether this was stopped before the end."""
    ids = _to_make(spec, request.any_version)
    rows, runs = counted(len(spec.rows), "row"), counted(len(spec.runs), "run")
    print(f"{rows}, {runs}, {len(ids)} to make; results in {spec.folder}", flush=True)
    if not ids:
        return False
    summary = _Progress(spec, len(ids))
    try:
        _engine(spec, request).make(ids, summary)
    except KeyboardInterrupt:
        print("stopped by Ctrl-C; what was done is kept, and the same command goes on", flush=True)
        return True
    return request.detach


def _engine(spec: Spec, request: SweepRequest):
    if request.engine == "local":
        return Local(spec, request.jobs or free_cores(spec.threads))
    if request.engine == "slurm":
        from coupler.commands.sweep.slurm import Slurm

        return Slurm(spec, request.jobs or 100, request.chunk, request.options, request.detach)
    from coupler.commands.sweep.dask import Dask

    return Dask(spec, request.engine.removeprefix("dask-"), request.jobs or 10, request.options)


def _to_make(spec: Spec, any_version: bool) -> list[str]:
    """Ids of runs that have not ended for good; those of another version of the program begin anew."""
    now = program()
    left, old = [], 0
    for id in spec.runs:
        known = figures(spec, id)
        if known and not any_version and differences(known["program"], now):
            shutil.rmtree(spec.place(id), ignore_errors=True)
            for name in (f"{id}.json", f"{id}.open.json", f"{id}.log"):
                (spec.folder / "runs" / name).unlink(missing_ok=True)
            known, old = None, old + 1
        known = ended(spec, id)
        may_go_on = known and known["outcome"] == "gave up" and spec.sweep.cpu_seconds > known["cpu_limit"]
        if known is None or may_go_on:
            left.append(id)
    if old:
        print(
            f"note: {counted(old, 'run')} made by another version of the program, made again; --any-version keeps them"
        )
    return left


class _Progress:
    """Prints every run that has ended, an estimate of the time left, and each quantity that a run lacks, once."""

    def __init__(self, spec: Spec, total: int):
        self.sweep, self.free, self.lacking = spec.sweep, {row.free for row in spec.rows}, set()
        self.total, self.count, self.began = total, 0, time.monotonic()
        self.told: set[str] = set()
        self.label = {}
        units = {column.name: column.unit for column in spec.columns}
        for row in spec.rows:
            values = ", ".join(f"{k} {_with_unit(v, units.get(k, ''))}" for k, v in row.values.items())
            self.label.setdefault(row.id, f"row {row.number}: {values}" if values else f"row {row.number}")
            if row.free:
                self.label.setdefault(row.free, f"free field of row {row.number}")

    def __call__(self, found: dict) -> None:
        self.count += 1
        per_run = (time.monotonic() - self.began) / self.count
        left = per_run * (self.total - self.count)
        reason = f": {self._reason(found)}" if found["reason"] else ""
        rest = f"  (about {terminal.duration(left)} left)" if self.count < self.total else ""
        print(
            f"{self.count}/{self.total}  {self.label.get(found['id'], found['id'])}: {found['outcome']}, "
            f"{found['cpu_seconds']:.3g} CPU s{rest}{reason}",
            flush=True,
        )
        self._lacks(found)

    def _reason(self, found: dict) -> str:
        """Why a run did not reach its end; the first clause where another run has told the same but for numbers and
        names."""
        whole = str(found["reason"])
        kind = NUMBERS.sub("#", whole)
        if kind not in self.told:
            self.told.add(kind)
            return whole
        return re.split(r"[:;.] ", whole, maxsplit=1)[0]

    def _lacks(self, found: dict) -> None:
        """What the first run shows to have a wrong name would else be known when all runs are made."""
        if found["outcome"] != "done":
            return
        for q in self.sweep.quantity:
            read = found["readings"].get(q.name)
            of_it = (q.source == "free field") == (found["id"] in self.free)
            if read and read["why"] and of_it and q.name not in self.lacking:
                self.lacking.add(q.name)
                print(
                    f"note: it has no number of {q.name}: {read['why'].removeprefix(f'{q.name}: ')}",
                    flush=True,
                )


def _with_unit(value, unit: str) -> str:
    return as_said(value, unit) if isinstance(value, float) and unit else _brief(value)


def _brief(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _show(plan: Plan) -> None:
    """The first and last rows on the terminal."""
    head = [c.name + (f" [{c.unit}]" if c.unit else "") for c in plan.columns]
    seeds = list(plan.sweep.seeds)
    print(f"{counted(len(plan.rows), 'row')}, {counted(len(plan.runs), 'run')}")
    rows = plan.rows if len(plan.rows) <= SHOWN else (*plan.rows[: SHOWN // 2], *plan.rows[-SHOWN // 2 :])
    lines = [["row", *head, *seeds]]
    for row in rows:
        lines.append(
            [
                str(row.number),
                *(_brief(row.values[c.name]) for c in plan.columns),
                *(str(row.seeds[s]) for s in seeds),
            ]
        )
    if len(plan.rows) > SHOWN:
        lines.insert(1 + SHOWN // 2, ["..."] * len(lines[0]))
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    for line in lines:
        print("  ".join(cell.rjust(width) for cell, width in zip(line, widths)))


def finish(spec: Spec, stopped: bool) -> ExitCode:
    """Write tables, curves and report of what has ended by now; the exit code."""
    results = collect(spec)
    for path in write_tables(spec, results):
        print(f"table: {path}")
    if any(record["outcome"] != "not yet" for record in results.records):
        for sentence in page.analyse(spec, results):
            print(f"note: {sentence}")
        reason = missing("sweep") or pictures.figures("coupler.commands.view.sweep", spec.folder)
        if reason:
            print(f"note: no figures: {reason}")
    for sentence in results.lacking:
        print(f"note: {sentence}")
    for sentence in results.doubted:
        print(f"but: {sentence}")
    print(f"report: {page.write(spec, results)}")
    print(_summary(results))
    left = any(record["outcome"] not in FINAL for record in results.records)
    if stopped or left:
        return ExitCode.STOPPED
    failed = any(record["outcome"] in ("diverged", "gave up", "refused") for record in results.records)
    return ExitCode.DIVERGED if failed else ExitCode.DONE


def _summary(results: Results) -> str:
    """Number of rows by outcome."""
    counts: dict[str, int] = {}
    for outcome in results.column("outcome"):
        counts[outcome] = counts.get(outcome, 0) + 1
    cpu = sum(summary["cpu_seconds"] for summary in results.figures.values())
    summary = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    return f"{summary}; {terminal.duration(cpu)} of processor time"
