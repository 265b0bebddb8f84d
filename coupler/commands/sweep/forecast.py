"""The forecast cost of a sweep, from its completed runs or from the first steps of the first run.

The processor time is that of one run times the number of remaining runs. Where only some steps of a run were made, it
is (set-up) + (steps) (end time / time reached), and once for each worker the start of the program, since workers of
this machine fork their runs. Runs may differ, so this is a forecast and not a bound.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from coupler.case.schedule import Schedule, first_part
from coupler.checks.read_case import load
from coupler.commands.sweep.folder import Spec, ended
from coupler.commands.sweep.one import Process, kept_files
from coupler.program.errors import BadCase
from coupler.program.process import trouble
from coupler.program.quantities import counted
from coupler.program.terminal import Row, duration
from coupler.results.vtkhdf import read_times
from coupler.run.summary import read_summary

STEPS = 3
"""Steps of the longest length that the trial takes."""
TRIALS = 5
"""Runs that are tried: some may not stand at the start."""


def forecast(spec: Spec, jobs: int, forked: bool) -> list[Row]:
    """Rows for the terminal; forked: runs are forked from workers that have started once.

    Makes the trial where no run is done. Raises BadCase where that does not run."""
    done = [measured for id in spec.runs if (measured := ended(spec, id)) is not None]
    left = len(spec.runs) - len(done)
    if done:
        cpu, memory, disk = (
            sum(measured[n] for measured in done) / len(done) for n in ("cpu_seconds", "memory", "disk")
        )
        source, start = f"mean of {counted(len(done), 'run')} done so far", 0.0
    else:
        start, cpu, memory, disk = _trial(spec)
        source = "from the first steps of the first run, which also load the kernels: rather less"
    once = start * min(jobs, left) if forked else start * left
    return [
        Row("rows", len(spec.rows)),
        Row("runs", len(spec.runs), "", f"{left} of them to make"),
        Row("a run", cpu, "CPU s", source),
        Row("processor time", duration(cpu * left + once)),
        Row(
            "wall time",
            duration((cpu * left + once) / jobs),
            "",
            f"{jobs} at a time, if each has a core for itself",
        ),
        Row("memory", memory * jobs / 1e6, "MB", f"{memory / 1e6:.0f} MB each, {jobs} at a time"),
        Row("disk", disk * left / 1e6, "MB", f"keep = '{spec.sweep.keep}'; {_free(spec)}"),
    ]


def _free(spec: Spec) -> str:
    there = next(place for place in (spec.folder, *spec.folder.parents) if place.is_dir())
    return f"{shutil.disk_usage(there).free / 1e6:.4g} MB are free"


def _trial(spec: Spec) -> tuple[float, float, float, float]:
    """CPU seconds of the start of the program and of the run itself, memory [B] and disk [B] of the first run
    that begins, from its first steps."""
    measured = ""
    for id in list(spec.runs)[:TRIALS]:
        found = _first_steps(spec, id)
        if not isinstance(found, str):
            return found
        measured = measured or found
    raise BadCase([f"the first steps of the first run: {measured}"])


def _first_steps(spec: Spec, id: str) -> tuple[float, float, float, float] | str:
    """The same for the given run; how it ended where it failed earlier."""
    case = load(spec.case_file, spec.runs[id]).case
    end = case.time.end
    short = min(end, STEPS * case.time.step_max)
    with tempfile.TemporaryDirectory() as folder:
        place, log = Path(folder) / "run", Path(folder) / "log"
        sets = [w for o in (*spec.runs[id], *first_part(case, short)) for w in ("--set", o)]
        cost = Process(spec.threads)(["run", str(spec.case_file), *sets, "--output", str(place)], log)
        if cost.exit_code:
            return trouble(cost.exit_code, log.read_text(encoding="utf-8", errors="replace"))
        figures = read_summary(place)["figures"]
        more = end / figures["time"]
        disk = _disk_of_whole(place, spec.sweep.keep, more, round(end / Schedule.of(case).interval) + 1)
    parts = figures["cpu_seconds"]
    steps = sum(seconds for part, seconds in parts.items() if part != "set-up")
    own = parts.get("set-up", 0.0) + steps
    return cost.cpu_seconds - own, own + steps * (more - 1.0), cost.peak_memory, disk


def _disk_of_whole(place: Path, keep: str, more: float, states: int) -> float:
    """Size [B] of the files that `keep` leaves of a run that takes `more` times as long as the one in `place` and
    writes so many states: rows of its histories and its states grow, the rest stays."""
    total = 0.0
    for file in kept_files(place, keep):
        size, grows = file.stat().st_size, 0.0
        if file.parent.name == "history":
            grows = (more - 1.0) * sum(len(line) for line in file.open("rb") if line[:1].isdigit())
        elif file.suffix == ".vtkhdf" and file.name != "solids.vtkhdf":
            grows = (states / max(len(read_times(file)), 1) - 1.0) * size
        total += size + grows
    return total
