"""Runs as jobs of Slurm, through submitit: an array of jobs, each of which makes one run or a few in sequence.

A job that approaches its time limit receives a signal `signal_delay_s` before. Its run then writes a checkpoint, and
the job is put into the queue again and continues from there; so does a job that Slurm itself requeues (`scontrol
requeue`, a lost node). The files of the sweep record how a run ended. Slurm is only asked which jobs are in its queue,
so that no accounting is needed. jobs.json contains the job of each run, so that a repeated call waits for the existing
jobs.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from coupler.commands.sweep.folder import Spec, ended, figures, read_spec, write_figures
from coupler.commands.sweep.one import Process, make
from coupler.commands.sweep.options import keywords
from coupler.program.errors import BadCall, SurgebreakError
from coupler.program.extras import need
from coupler.program.process import environment
from coupler.program.quantities import counted
from coupler.run.directory import write_json

Tell = Callable[[dict], None]
POLL = 2.0
"""Seconds between two looks at the queue."""
PATIENCE = 3
"""Number of queries in which a job may be absent before its run is reported as lost: files appear with a delay."""
MINUTES = 60
"""Time limit of a job unless --option time=... says otherwise."""
LISTS = ("setup", "teardown", "srun_args")
"""Options that may be given several times."""
REQUEUES = 100
"""Times that a job may reach its time limit and go on."""


class NoSlurm(SurgebreakError):
    """The commands of Slurm are missing or fail."""


class Work:
    """What a job does: make runs of a sweep. submitit calls it, and `checkpoint` before the time is over."""

    def __init__(self, folder: Path, ids: tuple[str, ...]):
        self.folder, self.ids = folder, ids
        self.execute: Process | None = None

    def __call__(self) -> list[str]:
        """Outcomes of the runs; those that ended for good in an earlier life of the job are left alone."""
        spec = read_spec(self.folder)
        self.execute = Process(spec.threads)
        return [make(spec, id, self.execute)["outcome"] for id in self.ids]

    def checkpoint(self):
        """Have the present run write its checkpoint, then go on in the next life of the job."""
        from submitit.helpers import DelayedSubmission

        if self.execute is not None:
            self.execute.stop()
            if self.execute.child is not None:
                self.execute.child.wait()
        return DelayedSubmission(Work(self.folder, self.ids))


class Slurm:
    """Submits jobs and waits for them. jobs: at a time; chunk: runs of a job; options: KEY=VALUE, named by submitit"""

    def __init__(self, spec: Spec, jobs: int, chunk: int, options: Iterable[str], detach: bool):
        need("slurm")
        missing = [name for name in ("sbatch", "srun", "squeue", "scancel") if shutil.which(name) is None]
        if missing:
            raise NoSlurm(
                f"--engine slurm: no {', '.join(missing)} on this machine's PATH; call it where sbatch works"
            )
        self.spec, self.jobs, self.chunk, self.detach = spec, jobs, chunk, detach
        self.options = keywords(options, LISTS)

    def make(self, ids: Iterable[str], tell: Tell) -> None:
        """Submit the runs that are in no job yet, and report how each ended, unless the user does not want to wait."""
        known = _known(self.spec)
        queue = in_queue(set(known.values()))
        wanted = list(ids)
        waiting = {id: known[id] for id in wanted if known.get(id) in queue}
        new = [id for id in wanted if id not in waiting]
        if new:
            waiting |= self._submit(new)
            write_json(self.spec.folder / "jobs.json", known | waiting)
        jobs = sorted(set(waiting.values()))
        print(
            f"{counted(len(waiting), 'run')} in {counted(len(jobs), 'job')} of Slurm, {jobs[0]} to {jobs[-1]}",
            flush=True,
        )
        if not self.detach:
            self._wait(waiting, tell)

    def _submit(self, ids: list[str]) -> dict[str, str]:
        """The job of each run. Raises BadCall for unknown options, NoSlurm where sbatch refuses."""
        import submitit
        from submitit.core.utils import FailedJobError

        os.environ.update(environment())  # sbatch hands it on to the jobs
        folder = self.spec.folder / "jobs"
        groups = [tuple(ids[k : k + self.chunk]) for k in range(0, len(ids), self.chunk)]
        parameters = {
            "time": MINUTES,
            "cpus_per_task": self.spec.threads,
            "job_name": "surgebreak",
            "array_parallelism": self.jobs,
        } | self.options
        try:
            executor = submitit.SlurmExecutor(folder, max_num_timeout=REQUEUES)
            executor.update_parameters(**parameters)
            with executor.batch():
                made = [executor.submit(Work(self.spec.folder, group)) for group in groups]
        except (ValueError, TypeError) as error:
            raise BadCall([f"--option: {error}"]) from error
        except FailedJobError as error:
            raise NoSlurm(f"sbatch refused the jobs: {error}") from error
        return {id: job.job_id for job, group in zip(made, groups) for id in group}

    def _wait(self, waiting: dict[str, str], tell: Tell) -> None:
        missing = dict.fromkeys(waiting, 0)
        while waiting:
            queue = in_queue(set(waiting.values()))
            for id, job in list(waiting.items()):
                record = ended(self.spec, id)
                if record is None and job not in queue:
                    missing[id] += 1
                    record = self._left(id, job) if missing[id] >= PATIENCE else None
                if record is not None:
                    del waiting[id]
                    tell(record)
            if waiting:
                time.sleep(POLL)

    def _left(self, id: str, job: str) -> dict:
        """The report of a run whose job is gone: how its last process ended, or that this is unknown."""
        record = figures(self.spec, id)
        if record is not None and record["job"] and record["outcome"] != "lost":
            return record
        found = (record or _nothing(id)) | {
            "outcome": "lost",
            "reason": f"job {job} is no longer in the queue and left no result: cancelled, killed, or out of memory; "
            f"what it printed is in {self.spec.folder / 'jobs'}",
        }
        write_figures(self.spec, id, found, final=False)
        return found


def _nothing(id: str) -> dict:
    from coupler.run.fingerprint import program

    return {
        "id": id, "exit_code": None, "cpu_seconds": 0.0, "wall_seconds": 0.0, "memory": 0, "disk": 0, "attempts": 0,
        "cpu_limit": 0.0, "time": None, "host": "", "job": "", "program": program(), "readings": {},
    }  # fmt: skip


def _known(spec: Spec) -> dict[str, str]:
    path = spec.folder / "jobs.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def in_queue(jobs: set[str]) -> set[str]:
    """Those of the jobs that are waiting or running. Raises NoSlurm where the queue cannot be asked."""
    if not jobs:
        return set()
    words = ["squeue", "--me", "--noheader", "--array", "--format=%i"]
    record = subprocess.run(words, capture_output=True, text=True, check=False)
    if record.returncode:
        raise NoSlurm(
            f"squeue: {record.stderr.strip()}; the jobs go on, the same command waits for them again"
        )
    return jobs & set(record.stdout.split())


def cancel(spec: Spec, which: tuple[str, ...]) -> str:
    """scancel of all jobs of a sweep, or of those that make some rows; what was done, in words. Raises BadCall."""
    known = _known(spec)
    if which == ("all",):
        ids = list(known)
    else:
        numbers = {str(row.number): row.id for row in spec.rows}
        wrong = [word for word in which if word not in numbers]
        if wrong:
            raise BadCall([f"--cancel {wrong[0]}: no such row; there are 0 to {len(spec.rows) - 1}, or all"])
        ids = [numbers[word] for word in which]
    jobs = sorted(in_queue({known[id] for id in ids if id in known}))
    if not jobs:
        return "none of these rows is in the queue"
    record = subprocess.run(["scancel", *jobs], capture_output=True, text=True, check=False)
    if record.returncode:
        raise NoSlurm(f"scancel: {record.stderr.strip()}")
    return f"cancelled {', '.join(jobs)}; what had begun has a checkpoint, and `surgebreak sweep` goes on with it"
