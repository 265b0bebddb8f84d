"""Runs on the workers of a dask cluster: PBS, SGE, LSF, OAR, HTCondor, Slurm through dask-jobqueue, or processes here.

The scheduler is this process: it must stay until the runs are done. A job that nears its time limit has its run write a
checkpoint and is given back; the run goes on in a new job, as does one whose job was deleted or whose node was lost. A
run under which four jobs died is reported as lost; the next call goes on with it.
"""

from __future__ import annotations

import itertools
import math
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from shlex import quote
from types import ModuleType

from coupler.commands.sweep import time_limit
from coupler.commands.sweep.folder import Spec, read_spec
from coupler.commands.sweep.one import OPEN, Process, make
from coupler.commands.sweep.options import keywords
from coupler.program.errors import BadCall
from coupler.program.extras import need
from coupler.program.process import environment

CLUSTERS = {
    "pbs": "PBSCluster",
    "slurm": "SLURMCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "oar": "OARCluster",
    "htcondor": "HTCondorCluster",
}
"""Classes of dask-jobqueue."""
MEMORY = "2GB"
WALLTIME = {"lsf": "01:00"}
"""Time limit of a job unless --option says otherwise; 01:00:00 where the batch system is not named here."""
LISTS = ("job_extra_directives", "job_script_prologue", "job_directives_skip", "worker_extra_args")
"""Options that may be given several times."""
HANDED_ON = ("PYTHONPATH", "LD_LIBRARY_PATH", "XDG_CACHE_HOME")
"""Environment variables passed to the jobs, besides all that begin with SURGEBREAK_."""
POLL = 2.0
"""Seconds between two looks at the jobs."""
PATIENCE = 60.0
"""Seconds without a worker after which a note says where to look."""


def make_one(folder: str, id: str) -> dict:
    """Make a run on a worker: how it ended, or `time_over` where its job has no time left; `worker`: this one."""
    from distributed import get_worker

    worker = get_worker().address
    spec, left = read_spec(Path(folder)), time_limit.left()
    if left <= 0.0:
        return {"id": id, "time_over": True, "worker": worker, "time": None}
    execute = Process(spec.threads)
    alarm = threading.Timer(left, execute.stop) if math.isfinite(left) else None
    if alarm is not None:
        alarm.daemon = True
        alarm.start()
    try:
        found = make(spec, id, execute)
    finally:
        if alarm is not None:
            alarm.cancel()
    over = (
        found["outcome"] in OPEN and time_limit.left() <= 0.0
    )  # killed where it was asked before its first step
    return found | {"time_over": over, "worker": worker}


class Dask:
    """Hands runs to the workers of a cluster; options: of its class in dask-jobqueue, as KEY=VALUE."""

    def __init__(self, spec: Spec, kind: str, jobs: int, options: Iterable[str]):
        need("dask")
        self.spec, self.kind, self.jobs = spec, kind, jobs
        self.options = keywords(options, LISTS)
        self.logs = spec.folder / "jobs"

    def make(self, ids: Iterable[str], tell: Callable[[dict], None]) -> None:
        """Make the runs and report how each ended."""
        from distributed import Client, wait

        os.environ.update(environment())
        number = itertools.count()
        with self._cluster() as cluster, Client(cluster) as client:

            def submit(id: str):
                key = f"{id}-{next(number)}"
                return client.submit(make_one, str(self.spec.folder), id, key=key, retries=0, pure=False)

            waiting = {submit(id): id for id in ids}
            reached: dict[str, float] = {}
            asked = time.monotonic()
            while waiting:
                self._keep(cluster, client, len(waiting))
                asked = self._hint(client, asked)
                with suppress(TimeoutError):
                    wait(list(waiting), timeout=POLL, return_when="FIRST_COMPLETED")
                for future in [f for f in waiting if f.done()]:
                    id = waiting.pop(future)
                    found = future.result() if future.status == "finished" else self._lost(id, future)
                    if found.get("time_over") and _gained(found, reached):
                        client.retire_workers([found["worker"]], close_workers=True)
                        waiting[submit(id)] = id
                    else:
                        tell(found)

    def _keep(self, cluster, client, wanted: int) -> None:
        """Keep as many jobs as there are runs for: replace those that ended, and release workers without a run."""
        target, there = min(self.jobs, wanted), len(cluster.worker_spec)
        if there <= target:
            cluster.scale(target)
            return
        busy = {address for address, keys in client.processing().items() if keys}
        workers = client.scheduler_info(n_workers=-1)["workers"]
        idle = [worker["name"] for address, worker in workers.items() if address not in busy]
        if idle:
            cluster.sync(cluster.scale_down, idle[: there - target])

    def _hint(self, client, asked: float) -> float:
        """Print once where to look if no job runs. asked: time of the request for jobs; infinite once printed."""
        if client.scheduler_info(n_workers=-1)["workers"]:
            return math.inf
        if time.monotonic() < asked + PATIENCE:
            return asked
        print(
            "note: no job runs yet: they wait in the queue of the cluster, or end at once, and then say why in "
            f"{self.logs}",
            flush=True,
        )
        return math.inf

    def _cluster(self):
        """A started cluster. Raises BadCall for unknown options."""
        if self.kind == "local":
            from distributed import LocalCluster

            return LocalCluster(
                n_workers=self.jobs, threads_per_worker=1, dashboard_address=None, **self.options
            )
        try:
            return getattr(jobqueue(), CLUSTERS[self.kind])(**self.words())
        except (TypeError, ValueError) as error:
            raise BadCall([f"--engine dask-{self.kind}: {error}"]) from error

    def words(self) -> dict:
        """Keywords of the class of dask-jobqueue. Raises ValueError for a time limit that cannot be read."""
        words: dict = {"memory": MEMORY, "log_directory": str(self.logs), **self.options}
        words |= {"cores": self.spec.threads, "processes": 1}  # a job makes one run at a time
        words["worker_extra_args"] = ["--nthreads", "1", *self.options.get("worker_extra_args", [])]
        prologue = [
            f"export {name}={quote(text)}" for name, text in sorted(os.environ.items()) if _handed(name)
        ]
        prologue.append("export PYTHONSAFEPATH=1")
        if self.kind == "htcondor":
            words.setdefault("disk", "1GB")
        else:
            words["walltime"] = str(words.get("walltime", WALLTIME.get(self.kind, "01:00:00")))
            prologue += time_limit.lines(time_limit.seconds(self.kind, words["walltime"]))
        words["job_script_prologue"] = [*prologue, *self.options.get("job_script_prologue", [])]
        return words

    def _lost(self, id: str, future) -> dict:
        """What is reported of a run whose jobs died."""
        reason = f"its jobs died, what they printed is in {self.logs}: {future.exception()}"
        return {"id": id, "outcome": "lost", "reason": reason, "cpu_seconds": 0.0}


def _handed(name: str) -> bool:
    return name in HANDED_ON or (name.startswith("SURGEBREAK_") and name != time_limit.VARIABLE)


def _gained(found: dict, reached: dict[str, float]) -> bool:
    """Whether a run whose job ran out of time got further than in the job before; True for one that had not begun."""
    if found["time"] is None:
        return "outcome" not in found
    before, reached[found["id"]] = reached.get(found["id"], -math.inf), found["time"]
    return found["time"] > before


def jobqueue() -> ModuleType:
    """The package dask-jobqueue. Its import takes Ctrl-C over, so that this would end the program with code 0."""
    on_ctrl_c = signal.getsignal(signal.SIGINT)
    import dask_jobqueue

    signal.signal(signal.SIGINT, on_ctrl_c)
    return dask_jobqueue
