"""Runs on the workers of a dask cluster: PBS, SGE, LSF, OAR, HTCondor, Slurm through dask-jobqueue, or processes here.

The scheduler is this process: it must stay until the runs are done. A run whose worker dies is reported as lost, and
the next call goes on with it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path

from coupler.commands.sweep.folder import Spec, read_spec
from coupler.commands.sweep.one import Process, make
from coupler.program.errors import BadCase
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
USUAL = {"memory": "2GB", "walltime": "01:00:00"}
"""Of a job, unless --option says otherwise."""


def make_one(folder: str, id: str) -> dict:
    """Make a run on a worker."""
    spec = read_spec(Path(folder))
    return make(spec, id, Process(spec.threads))


class Dask:
    """Hands runs to the workers of a cluster; options: of its class in dask-jobqueue."""

    def __init__(self, spec: Spec, kind: str, jobs: int, options: dict[str, str]):
        need("dask")
        self.spec, self.kind, self.jobs = spec, kind, jobs
        self.options = {name: int(text) if text.isdecimal() else text for name, text in options.items()}

    def make(self, ids: Iterable[str], tell: Callable[[dict], None]) -> None:
        """Make the runs and tell how each ended."""
        from distributed import Client, as_completed

        os.environ.update(environment())
        with self._cluster() as cluster, Client(cluster) as client:
            futures = {
                client.submit(make_one, str(self.spec.folder), id, key=id, retries=0, pure=False): id
                for id in ids
            }
            for future in as_completed(futures):
                tell(future.result() if future.status == "finished" else _lost(futures[future], future))

    def _cluster(self):
        """A started cluster with as many workers as runs at a time. Raises BadCase for unknown options."""
        if self.kind == "local":
            from distributed import LocalCluster

            return LocalCluster(
                n_workers=self.jobs, threads_per_worker=1, dashboard_address=None, **self.options
            )
        import dask_jobqueue

        words = {"cores": self.spec.threads, "processes": 1, **USUAL, **self.options}
        if self.kind in ("oar", "htcondor", "lsf", "sge"):
            words.setdefault("log_directory", str(self.spec.folder / "jobs"))
        if self.kind == "htcondor":
            words.pop("walltime")
            words.setdefault("disk", "1GB")
        try:
            cluster = getattr(dask_jobqueue, CLUSTERS[self.kind])(
                job_script_prologue=[
                    f"export PYTHONPATH={os.environ.get('PYTHONPATH', '')}",
                    "export PYTHONSAFEPATH=1",
                ],
                **words,
            )
        except (TypeError, ValueError) as error:
            raise BadCase([f"--engine dask-{self.kind}: {error}"]) from error
        cluster.scale(jobs=self.jobs)
        return cluster


def _lost(id: str, future) -> dict:
    return {"id": id, "outcome": "lost", "reason": f"its worker: {future.exception()}", "cpu_seconds": 0.0}
