"""A sweep on a real Slurm: jobs that are cancelled, killed, put back into the queue and warned of their end go on from
their checkpoints, one that cannot begin is a row with its reason, and the numbers are those of runs made here."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest

from coupler.commands.sweep.folder import read_spec
from coupler.commands.sweep.results import collect
from coupler.program.process import environment

from .arm import CASE, WEAK
from .slurm_here import Slurm

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


def until(there, seconds=300.0):
    end = time.monotonic() + seconds
    while not there():
        assert time.monotonic() < end
        time.sleep(0.3)


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
        for row in (CANCELLED, KILLED, REQUEUED, WARNED):
            until(lambda row=row: any((spec.place(ids[row]) / "checkpoints").glob("*")))
        assert surgebreak("sweep", case, "--cancel", CANCELLED, variables=slurm.variables).returncode == 0
        os.kill(json.loads((spec.place(ids[KILLED]) / "run.json").read_text())["process"], 9)
        slurm.output_of("scontrol", "requeue", jobs[ids[REQUEUED]])
        slurm.output_of("scancel", "--signal=USR2", jobs[ids[WARNED]])
        until(lambda: jobs[ids[CANCELLED]] not in slurm.output_of("squeue", "-h", "-r", "-o", "%i").split())
        until(lambda: jobs[ids[KILLED]] not in slurm.output_of("squeue", "-h", "-r", "-o", "%i").split())
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
