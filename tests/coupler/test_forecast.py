"""The forecast of `check` against what a run takes."""

import re
import subprocess
import sys

import pytest

WATER = """
[case]
title = "t"
[time]
end = 0.05
step_max = 0.01
output_every = 0.025
[tank]
lower = [0, 0, 0]
upper = [1, 0.5, 0.5]
cell = 0.05
[[water.fill]]
lower = [0, 0, 0]
upper = [0.4, 0.5, 0.3]
"""
BLOCK = """
[structure]
[[structure.block]]
name = "a"
size = [0.2, 0.2, 0.2]
centre = [0.7, 0.25, 0.1]
[contact]
stiffness = "1 MN/m"
"""


COMMAND = [sys.executable, "-m", "coupler.commands.cli"]
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
print(1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6)
"""
"""Tells the largest memory [MB] of a command, from a small process: a child's peak begins with that of its parent."""


def said(*words):
    return subprocess.run([*COMMAND, *map(str, words)], capture_output=True, text=True)


@pytest.mark.parametrize("text", [WATER, WATER + BLOCK], ids=["water", "water and a block"])
def test_the_memory_that_is_forecast_is_what_a_run_takes(tmp_path, text):
    """Within a quarter, small scenes: that is the programs and their kernels, written fields included.

    The first of the two runs compiles what is not compiled yet, which takes a gigabyte more."""
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    assert said("run", tmp_path).returncode == 0
    forecast = float(re.search(r"memory +([\d.]+) MB", said("check", tmp_path).stdout).group(1))
    run = subprocess.run(
        [sys.executable, "-c", PEAK, *COMMAND, "run", tmp_path], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert forecast == pytest.approx(float(run.stdout), rel=0.25)
