"""A sweep on a real Slurm: jobs that are cancelled, killed, put back into the queue and warned of their end go on from
their checkpoints, one that cannot begin is a row with its reason, and the numbers are those of runs made here."""

import contextlib
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from coupler.commands.sweep.folder import read_spec
from coupler.commands.sweep.results import collect
from coupler.program.process import environment

from .arm import CASE, WEAK
from .slurm_here import Slurm
from .until import until

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.timeout(1500),
    pytest.mark.skipif(bool(Slurm.missing()), reason=Slurm.missing()),
]
LONG = "0.5 s"
"""End of the runs that something happens to."""
TABLE = f"""\
time.end,joints.strength,structure.block[1].velocity[2]
10 ms,1e6,0.01
10 ms,{WEAK},0.01
{LONG},1e6,0.01
{LONG},1e6,0.02
{LONG},1e6,0.03
{LONG},1e6,0.04
"""
CANNOT_STAND, CANCELLED, KILLED, REQUEUED, WARNED = 1, 2, 3, 4, 5
SWEEP = """
[sweep]
table = "rows.csv"
[[sweep.quantity]]
name = "place"
table = "history/gauges.csv"
column = "arm_centre_z"
"""


def surgebreak(*words, variables):
    command = [sys.executable, "-m", "coupler.cli", *map(str, words)]
    done = subprocess.run(
        command, env=environment() | variables, capture_output=True, text=True, check=False, timeout=1200
    )
    print(done.stdout, done.stderr)
    return done


class Row:
    """A run of the sweep in a job of its own."""

    def __init__(self, spec, row, job):
        self.place, self.job, self.process = spec.place(spec.rows[row].id), job, None

    def held(self):
        """Stops the process of the run as soon as it has a checkpoint: however busy the machine is, it then neither
        ends nor gets far before something happens to it."""
        if self.process is None and self.has_checkpoint():
            self.process = self.summary()["process"]
            os.kill(self.process, signal.SIGSTOP)
            assert self.summary()["status"] == "running", "ended before it could be held: make LONG longer"
        return self.process is not None

    def has_checkpoint(self):
        """One that is whole: what is being written has another name."""
        return any((self.place / "checkpoints").glob("[0-9]*.h5"))

    def summary(self):
        return json.loads((self.place / "run.json").read_text())


def test_jobs_that_end_before_their_time_go_on(tmp_path):
    case = tmp_path / "case"
    case.mkdir()
    (case / "case.toml").write_text(CASE + SWEEP, encoding="utf-8")
    (case / "rows.csv").write_text(TABLE, encoding="utf-8")
    folder = case / "runs" / "sweep"
    with Slurm(tmp_path / "slurm", cpus=6) as slurm:
        sweep = ("sweep", case, "--engine", "slurm", "--option", "time=20", "--option", "signal_delay_s=5")
        assert surgebreak(*sweep, "--detach", variables=slurm.variables).returncode == 4
        spec = read_spec(folder)
        ids = {row.number: row.id for row in spec.rows}
        jobs = json.loads((folder / "jobs.json").read_text())
        rows = {row: Row(spec, row, jobs[ids[row]]) for row in (CANCELLED, KILLED, REQUEUED, WARNED)}
        until(lambda: all([row.held() for row in rows.values()]), "a checkpoint of each long run", every=0.05)
        assert surgebreak("sweep", case, "--cancel", CANCELLED, variables=slurm.variables).returncode == 0
        os.kill(rows[KILLED].process, signal.SIGKILL)
        slurm.output_of("scontrol", "requeue", rows[REQUEUED].job)
        slurm.output_of("scancel", "--signal=USR2", rows[WARNED].job)
        for row in rows.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(row.process, signal.SIGCONT)
        for number in (CANCELLED, KILLED):
            until(lambda job=rows[number].job: job not in slurm.queue(), f"row {number} out of the queue")
        done = surgebreak(*sweep, variables=slurm.variables)
        assert done.returncode == 0
        again = surgebreak(*sweep, variables=slurm.variables)
        assert " 0 to make" in again.stdout
    here = collect(read_spec(folder))
    outcomes = here.column("outcome")
    assert outcomes[CANNOT_STAND] == "cannot stand"
    assert "cannot carry" in here.column("reason")[CANNOT_STAND]
    assert all(outcome == "done" for row, outcome in enumerate(outcomes) if row != CANNOT_STAND)
    for row in (CANCELLED, KILLED, REQUEUED, WARNED):
        summary = json.loads((spec.place(ids[row]) / "run.json").read_text())
        assert summary["resumed"], row
        assert summary["resumed"][0]["time"] > 0.0
    surgebreak("sweep", case, "--output", tmp_path / "local", "--jobs", "1", variables={})
    local = collect(read_spec(tmp_path / "local"))
    assert np.isfinite(here.column("place")[2:]).all()
    assert here.column("place")[2:] == local.column("place")[2:]
    assert len(set(here.column("place")[2:])) == 4
