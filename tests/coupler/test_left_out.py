"""What a case does not need is not loaded, and a wish to stop ends a real run with everything readable."""

import json
import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.program.provenance import ROOT
from coupler.results.history import read_history
from coupler.run.left_out import HEAVY, note_work

from .test_case_file import WATER, write

DRY = ROOT / "cases" / "bonded_wall_pulled"
LOADED = (
    "import sys; sys.argv = ['surgebreak', 'run', *sys.argv[1:]]\n"
    "from coupler.commands.cli import main\n"
    "try: main()\n"
    "except SystemExit as end: assert not end.code, end.code\n"
    "print(*sys.modules, file=sys.stderr)"
)
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}


def loaded(*arguments):
    """Top-level packages in the process of a run."""
    return {name.split(".")[0] for name in modules(*arguments)}


def modules(*arguments):
    """Modules in the process of a run."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED, *map(str, arguments)],
        capture_output=True, text=True, check=False, env=ENVIRONMENT,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


def figures(run):
    return json.loads((run / "run.json").read_text(encoding="utf-8"))["figures"]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_dry_case_loads_neither_the_water_nor_pictures(threads, tmp_path):
    """Nor does it book time to the water, count its cells or write its tables; run.json says so."""
    names = modules(DRY, "--end", "2 ms", "--output", tmp_path / "run", "--threads", threads)
    assert ("kernels.threads" in names) == (threads > 1)
    packages = {name.split(".")[0] for name in names}
    assert "yade" in packages
    assert "yade_scripts.dynamics.sleep" not in names
    assert packages & {"skfem", "fluid", "vtkmodules", "pyvista", "matplotlib"} == set()
    reported = figures(tmp_path / "run")
    assert {name for name, is_loaded in reported["imports"].items() if is_loaded} == packages & set(HEAVY)
    assert reported["cpu_seconds"].keys() == {"set-up", "structure", "output", "other"}
    assert reported["work"].keys() == {"blocks", "loose_blocks", "joints", "live_joints", "contacts"}
    assert reported["work"]["joints"] == reported["joints"]
    assert not (tmp_path / "run" / "history" / "water.csv").exists()


def test_a_case_of_water_alone_never_loads_yade_or_pictures(tmp_path):
    packages = loaded(write(tmp_path, WATER), "--end", "20 ms", "--output", tmp_path / "run")
    assert "fluid" in packages
    assert packages & {"yade", "yade_scripts", "vtkmodules", "pyvista", "matplotlib"} == set()
    reported = figures(tmp_path / "run")
    assert reported["cpu_seconds"].keys() == {"set-up", "water", "pressure", "output", "other"}
    assert reported["work"].keys() == {"mesh_cells", "cells", "wet_cells", "bodies", "bodies_cut", "passes"}
    assert 0 < reported["work"]["wet_cells"] < reported["work"]["cells"] == reported["work"]["mesh_cells"]
    assert not (tmp_path / "run" / "history" / "structure.csv").exists()


def ask_by_file(child, directory):
    (directory / "stop").touch()


def ask_by_signal(child, directory):
    child.send_signal(signal.SIGINT)


@pytest.mark.parametrize("ask", [ask_by_file, ask_by_signal])
def test_a_wish_to_stop_ends_a_run_cleanly(tmp_path, ask):
    """Exit code 4, the reason in run.json, and a history of whole steps up to there."""
    place = tmp_path / "run"
    command = [
        sys.executable,
        "-m",
        "coupler.commands.cli",
        "run",
        str(DRY),
        "--end",
        "10 min",
        "--output",
        str(place),
    ]
    child = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT
    )
    table = place / "history" / "energy.csv"
    until = time.monotonic() + 60
    while not (table.exists() and table.read_text(encoding="utf-8").count("\n") > 30):
        assert time.monotonic() < until
        assert child.poll() is None, child.stderr.read()
        time.sleep(0.05)
    ask(child, place)
    _, reported = child.communicate(timeout=60)
    assert child.returncode == 4, reported
    summary = json.loads((place / "run.json").read_text(encoding="utf-8"))
    assert (summary["status"], summary["exit_code"]) == ("stopped", 4)
    history = read_history(table)
    assert history["time"][-1] == pytest.approx(summary["figures"]["time"], rel=1e-12)


WITHOUT_YADE = (
    "import sys; sys.argv = ['surgebreak', 'run', *sys.argv[1:]]\n"
    "from yade_scripts.yade_side import engine\n"
    "engine.PACKAGED = ('/nowhere/yade',)\n"
    "from coupler.commands.cli import main\n"
    "main()"
)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (False, "YADE is not installed (looked for /nowhere/yade)"),
        (True, "is not the discrete element code YADE"),
    ],
)
def test_a_run_without_the_right_yade_says_what_to_do(tmp_path, wrong, says):
    """Another project on the package index is called yade; a user may have installed that one."""
    if wrong:
        (tmp_path / "yade").mkdir()
        (tmp_path / "yade" / "__init__.py").write_text("", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_YADE, str(DRY), "--output", str(tmp_path / "run")],
        capture_output=True, text=True, check=False, env=ENVIRONMENT | {"PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 1
    assert says in done.stderr
    assert "apt install yade" in done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))["exit_code"] == 1


def test_counts_of_work_are_means_over_the_steps():
    work = {}
    for step, count in enumerate([2, 4, 9], start=1):
        structure = SimpleNamespace(n=10, loose=lambda n=count: np.arange(10) < n, contacts=list)
        coupling = SimpleNamespace(water=None, structure=structure)
        note_work(work, coupling, None, SimpleNamespace(intact=count, broken=10 - count), step)
    assert work["loose_blocks"] == pytest.approx(5.0)
    assert work["live_joints"] == pytest.approx(5.0)
    assert work["joints"] == pytest.approx(10.0)
