"""Runs that stop and go on, for the tests of resume and of checkpoints."""

import json
import subprocess
import sys

import numpy as np

from coupler.checks.read_case import load
from coupler.commands.warm_up import Silent
from coupler.results import vtkhdf
from coupler.run.checkpoint import FOLDER, Checkpoint, listed
from coupler.run.directory import RunDirectory
from coupler.run.resume import prepare
from coupler.run.run import run

DRY = """\
[case]
title = "a shot breaks a column"
[time]
end = "0.1 s"
step_max = "5 ms"
output_every = "10 ms"
checkpoint_every = "40 ms"
[structure]
[[structure.column]]
name = "column"
foot = [0.5, 0.5, 0]
height = 3
drums = 3
size = [1, 1]
[[structure.block]]
name = "shot"
centre = [-1, 0.5, 1.6]
size = [0.5, 0.5, 0.5]
velocity = [12, 0, 0]
[structure.ground]
[contact]
[joints]
strength = "0.2 MPa"
opening_at_failure = "2 mm"
"""


def directory_of(tmp_path, text):
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    return tmp_path


def begin(place, text, output, *overrides, reporter=None):
    """A whole run in this process; its directory."""
    file = load(directory_of(place, text), overrides)
    with RunDirectory.create(file, output) as directory:
        run(file.case, directory, reporter or Silent())
    return directory.path


def go_on(path, *overrides, reported=None, any_version=True):
    """Resume in this process. any_version: a commit between the two runs of a test does not matter."""
    found = prepare(path, overrides, any_version, (reported if reported is not None else []).append)
    with found.directory:
        run(found.file.case, found.directory, Silent(), found.checkpoint)
    return found


def check_same(one, two):
    """Histories byte for byte, fields value for value, and everything that the last checkpoints hold."""
    tables = [p.relative_to(one) for p in (*one.glob("history/*.csv"), *one.glob("*.csv"))]
    assert len(tables) > 1
    for table in tables:
        assert (one / table).read_bytes() == (two / table).read_bytes(), table
    for name in ("fields.vtkhdf", "blocks.vtkhdf"):
        if (one / name).exists():
            check_same_steps(one / name, two / name)
    reported = [
        json.loads((place / "run.json").read_text())["figures"].get("verdict") for place in (one, two)
    ]
    assert reported[0] == reported[1]
    a, b = (Checkpoint.read(listed(place / FOLDER)[0]) for place in (one, two))
    assert a.path.name == b.path.name
    assert set(a.arrays) == set(b.arrays)
    for name in a.arrays:
        np.testing.assert_array_equal(a.arrays[name], b.arrays[name], err_msg=name, strict=True)
    figures = [
        json.loads((place / "run.json").read_text(encoding="utf-8"))["figures"] for place in (one, two)
    ]
    for found in figures:
        del found["cpu_seconds"]
        del found["imports"]  # of the process: the first one here has those of other tests
    assert figures[0] == figures[1]


def check_same_steps(one, two):
    times = vtkhdf.read_times(one)
    np.testing.assert_array_equal(vtkhdf.read_times(two), times)
    for k in range(len(times)):
        (points, *data), (others, *other_data) = vtkhdf.read_step(one, k), vtkhdf.read_step(two, k)
        np.testing.assert_array_equal(points, others)
        for fields, other_fields in zip(data, other_data):
            assert set(fields) == set(other_fields)
            for name, field in fields.items():
                np.testing.assert_array_equal(field, other_fields[name], err_msg=f"{name} of step {k}")


def command(*words, check=True):
    done = subprocess.run(
        [sys.executable, "-m", "coupler.commands.cli", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert not check or done.returncode == 0, done.stderr
    return done
