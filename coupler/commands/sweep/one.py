"""Makes or continues one run of a sweep, reads it and keeps the files asked for: `python -m coupler.commands.sweep.one
FOLDER ID...`, also as the job of a cluster.

A run that was killed or stopped is continued from its newest checkpoint, or started again if there is none. The exit
code is 0 if all runs have ended in a way that would be the same again (done, or failed with a reason), otherwise 1.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path

from coupler.commands.study.runner import Cost
from coupler.commands.sweep.folder import Spec, ended, figures, read_spec, write_figures
from coupler.commands.sweep.quantities import asked, is_derived, middles, read_quantity
from coupler.program.errors import ExitCode, NoRun
from coupler.program.process import end_with, environment, trouble
from coupler.program.threads import VARIABLE
from coupler.run.checkpoint import FOLDER as CHECKPOINTS
from coupler.run.fingerprint import program
from coupler.run.lock import Busy, FileLock, RunLock
from coupler.run.summary import read_summary

Execute = Callable[[Sequence[str], Path], Cost]
"""Runs `surgebreak WORDS` to its end, with its output in a file."""

LEFT = {
    "table": ("case.toml", "run.json", "log.txt", "report.html"),
    "histories": (
        "case.toml",
        "run.json",
        "log.txt",
        "report.html",
        "effective.json",
        "history",
        "cracks.csv",
    ),
}
"""Files that are kept in the directory of a completed run."""
FINAL = ("done", "cannot stand", "refused", "diverged", "gave up")
"""Outcomes that would be the same again."""
PATIENCE = 60.0
"""Seconds to wait for another process that makes the same run."""
OPEN = ("stopped", "killed", "crashed", "lost")
"""Outcomes after which the next call goes on with the run."""


@dataclass
class Process:
    """An `Execute` that starts a process for each run; `stop` asks the present one to write a checkpoint and end."""

    threads: int = 1
    child: subprocess.Popen | None = field(default=None, repr=False)

    def __call__(self, words: Sequence[str], log: Path) -> Cost:
        """Run the command; user and system time and peak memory are those of the process and what it started."""
        began = time.perf_counter()
        variables = environment() | {VARIABLE: str(self.threads)}
        command = [sys.executable, "-m", "coupler.cli", *words]
        with log.open("a", encoding="utf-8") as stream:
            self.child = subprocess.Popen(
                command,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=variables,
                preexec_fn=partial(_begin, os.getpid()),
            )
            _, status, used = os.wait4(self.child.pid, 0)
        self.child.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - began
        return Cost(used.ru_utime + used.ru_stime, wall, used.ru_maxrss * 1024, self.child.returncode)

    def stop(self) -> None:
        """SIGTERM to the present run, and wait until it is gone."""
        if self.child is not None and self.child.returncode is None:
            self.child.send_signal(signal.SIGTERM)


def _begin(parent: int) -> None:
    """Prepare a new process for a run: it stops when the process that reads the run is gone. Slurm warns all processes
    of a job of its end by SIGUSR2, which is ignored here, because the parent then stops the run."""
    signal.signal(signal.SIGUSR2, signal.SIG_IGN)
    end_with(parent)


def make(spec: Spec, id: str, execute: Execute) -> dict:
    """How a run of a sweep ended; it is made, or goes on, unless it has ended for good."""
    try:
        with _alone(spec, id):
            return _make(spec, id, execute)
    except Busy as error:
        return {"id": id, "outcome": "lost", "reason": str(error), "cpu_seconds": 0.0, "time": None}


@contextlib.contextmanager
def _alone(spec: Spec, id: str) -> Iterator[None]:
    """Allow one process at a time to make a run; one that a killed sweep left behind may still be working on it.
    Raises Busy when that does not end within PATIENCE."""
    log, place = spec.folder / "runs" / f"{id}.log", spec.place(id)
    busy = f"{place}: a process of an earlier call still makes this run; call again when it is done, or end that one"
    lock = _patient(lambda: FileLock(log, busy))
    try:
        if place.is_dir():  # a run whose parent process was killed ends at its next step
            _patient(lambda: RunLock(place)).release()
        yield
    finally:
        lock.release()


def _patient(lock: Callable[[], FileLock]) -> FileLock:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return lock()
        except Busy:
            if time.monotonic() > end:
                raise
        time.sleep(0.2)


def _make(spec: Spec, id: str, execute: Execute) -> dict:
    known = ended(spec, id)
    if known is not None and not _may_go_on(spec, known):
        return known
    before = figures(spec, id) or {}
    place, log = spec.place(id), spec.folder / "runs" / f"{id}.log"
    limit = f"limits.cpu_seconds={spec.sweep.cpu_seconds!r}"
    cost = None
    if any((place / CHECKPOINTS).glob("*")):
        cost = execute(["resume", str(place), "--any-version", "--set", limit], log)
        cost = None if cost.exit_code == ExitCode.BAD_CASE else cost  # an incomplete checkpoint: start again
    if cost is None:
        shutil.rmtree(place, ignore_errors=True)
        log.write_bytes(b"")  # which is locked, so not removed
        before = {}
        sets = [word for override in (*spec.runs[id], limit) for word in ("--set", override)]
        cost = execute(["run", str(spec.case_file), *sets, "--output", str(place)], log)
    found = _record(spec, id, cost, before)
    write_figures(spec, id, found, found["outcome"] in FINAL)
    if _tidied(found["outcome"]):
        _tidy(place, spec.sweep.keep)
    return found


def _tidied(outcome: str) -> bool:
    """Whether the files of a run that ended so are removed but for those to be kept."""
    return outcome in FINAL and outcome != "gave up"


def _may_go_on(spec: Spec, known: dict) -> bool:
    """Whether a run was given up at a limit that is higher now."""
    return known["outcome"] == "gave up" and spec.sweep.cpu_seconds > known["cpu_limit"]


def _record(spec: Spec, id: str, cost: Cost, before: dict) -> dict:
    place = spec.place(id)
    try:
        summary = read_summary(place)
    except NoRun:  # it ended before it began
        summary = {}
    log = (spec.folder / "runs" / f"{id}.log").read_text(encoding="utf-8", errors="replace")
    outcome = outcome_of(cost.exit_code, summary)
    reason = "" if outcome == "done" else summary.get("exit_reason") or trouble(cost.exit_code, log)
    if outcome == "killed" and not summary.get("exit_reason"):
        reason = f"killed by {signal.Signals(-cost.exit_code).name}; no memory left, or somebody's wish"
    middles.cache_clear()
    read = {
        q.name: asdict(read_quantity(place, q))
        for q in asked(spec.sweep)
        if not is_derived(q) and outcome not in ("refused", "cannot stand")
    }
    return {
        "id": id,
        "outcome": outcome,
        "reason": reason,
        "exit_code": cost.exit_code,
        "cpu_seconds": max(
            cost.cpu_seconds + before.get("cpu_seconds", 0.0), summary.get("cpu_seconds", 0.0)
        ),
        "wall_seconds": cost.wall_seconds + before.get("wall_seconds", 0.0),
        "memory": max(cost.peak_memory, before.get("memory", 0)),
        "disk": disk_of(place, spec.sweep.keep if _tidied(outcome) else "all"),
        "attempts": before.get("attempts", 0) + 1,
        "cpu_limit": spec.sweep.cpu_seconds,
        "time": summary.get("figures", {}).get("time"),
        "doubts": summary.get("figures", {}).get("doubts", []),
        "host": platform.node(),
        "job": os.environ.get("SLURM_JOB_ID", ""),
        "program": program(),
        "readings": read,
    }


def outcome_of(exit_code: int, summary: dict) -> str:
    """One of FINAL and OPEN, from the exit code of a run and its run.json (empty without)."""
    if exit_code == ExitCode.DONE:
        return "done"
    if exit_code < 0:
        return "killed"
    if exit_code == ExitCode.BAD_CASE:
        return "cannot stand" if summary.get("error") == "CannotStand" else "refused"
    if exit_code == ExitCode.DIVERGED:
        return "diverged"
    if exit_code == ExitCode.STOPPED:
        return "gave up" if "limits.cpu_seconds" in (summary.get("exit_reason") or "") else "stopped"
    return "crashed"


def _tidy(place: Path, keep: str) -> None:
    """Remove the files of a run directory that are not to be kept."""
    for entry in place.iterdir() if place.is_dir() else ():
        if _stays(entry, keep):
            continue
        if entry.is_dir():
            shutil.rmtree(entry)
        else:
            entry.unlink()


def _stays(entry: Path, keep: str) -> bool:
    return keep == "all" or entry.name in LEFT[keep]


def disk_of(place: Path, keep: str) -> int:
    """Size [B] of the files in a run directory that `keep` leaves there."""
    return sum(file.stat().st_size for file in kept_files(place, keep))


def kept_files(place: Path, keep: str) -> Iterator[Path]:
    """The files in a run directory that `keep` leaves there."""
    for entry in place.iterdir() if place.is_dir() else ():
        if _stays(entry, keep):
            yield from (file for file in (entry, *entry.rglob("*")) if file.is_file())


def main(words: list[str]) -> int:
    """The command of this module."""
    spec = read_spec(Path(words[0]))
    execute = Process(spec.threads)
    results = [make(spec, id, execute) for id in words[1:]]
    for found in results:
        print(json.dumps({name: found[name] for name in ("id", "outcome", "reason")}))
    return int(any(found["outcome"] not in FINAL for found in results))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
