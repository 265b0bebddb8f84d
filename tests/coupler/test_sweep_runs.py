"""Real runs of a sweep on this machine: those of a worker are what `surgebreak run` makes, and a dead one is a row."""

import json
import subprocess
import sys

import h5py
import numpy as np

from coupler.commands.sweep.folder import read_spec
from coupler.commands.sweep.plan import make_plan
from coupler.commands.sweep.results import collect
from coupler.program.process import environment

from .arm import CASE, WEAK

SWEEP = f"""
[sweep]
keep = "all"
[[sweep.vary]]
key = "joints.strength"
values = [1e6, 2e6, {WEAK}]
"""


def surgebreak(*words):
    command = [sys.executable, "-m", "coupler.cli", *map(str, words)]
    return subprocess.run(
        command, env=environment(), capture_output=True, text=True, check=False, timeout=280
    )


def test_a_forked_run_has_the_bits_of_a_run_of_its_own(tmp_path):
    """The second row: its process was forked after another run had been made by the same worker. The third
    one cannot stand; it is a row with that outcome, and the exit code says that all runs have ended."""
    (tmp_path / "case.toml").write_text(CASE + SWEEP, encoding="utf-8")
    done = surgebreak("sweep", tmp_path, "--jobs", 1, "--output", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    spec = read_spec(tmp_path / "out")
    assert collect(spec).column("outcome") == ["done", "done", "cannot stand"]
    overrides = make_plan(tmp_path).runs[spec.rows[1].id]
    assert surgebreak("run", tmp_path, *_sets(overrides), "--output", tmp_path / "alone").returncode == 0
    forked = spec.place(spec.rows[1].id)
    for table in sorted((tmp_path / "alone" / "history").glob("*.csv")):
        assert table.read_bytes() == (forked / "history" / table.name).read_bytes(), table.name
    with h5py.File(forked / "blocks.vtkhdf") as a, h5py.File(tmp_path / "alone" / "blocks.vtkhdf") as b:
        assert np.array_equal(a["VTKHDF/Points"], b["VTKHDF/Points"])
    reported = json.loads((forked / "run.json").read_text())["figures"]
    alone = json.loads((tmp_path / "alone" / "run.json").read_text())["figures"]
    for name in ("steps", "substeps", "energy_error", "largest_opening_rate"):
        assert reported[name] == alone[name]


def _sets(overrides):
    return [word for override in overrides for word in ("--set", override)]


def test_a_worker_that_dies_is_reported_and_its_runs_are_made_by_another(tmp_path, monkeypatch):
    """The first worker is killed before it answers; the rest goes to a second one."""
    from coupler.commands.sweep import local

    workers = iter(["import sys; sys.stdin.readline(); sys.exit(7)", ANSWER, ANSWER])
    real = subprocess.Popen
    monkeypatch.setattr(
        local.subprocess, "Popen", lambda words, **o: real([sys.executable, "-c", next(workers)], **o)
    )
    (tmp_path / "runs").mkdir()

    class Spec:
        folder, threads = tmp_path, 1

    reported = []
    local.Local(Spec, 1).make(["a", "b"], reported.append)
    assert [(found["id"], found["outcome"]) for found in reported] == [("a", "crashed"), ("b", "done")]
    assert "ended with 7" in reported[0]["reason"]


ANSWER = """
import json, sys
for line in sys.stdin:
    print(json.dumps({"id": line.strip(), "outcome": "done", "reason": "", "cpu_seconds": 0.0}), flush=True)
"""
