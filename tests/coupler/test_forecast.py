"""The forecast of `check` against what a run takes."""

import os
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


def said(*words):
    return subprocess.run(
        [sys.executable, "-m", "coupler.cli", *map(str, words)], capture_output=True, text=True
    )


@pytest.mark.parametrize("text", [WATER, WATER + BLOCK], ids=["water", "water and a block"])
def test_the_memory_that_is_forecast_is_what_a_run_takes(tmp_path, text):
    """Within a quarter, small scenes: that is the programs and their kernels, written fields included."""
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    forecast = float(re.search(r"memory +([\d.]+) MB", said("check", tmp_path).stdout).group(1))
    run = subprocess.Popen([sys.executable, "-m", "coupler.cli", "run", tmp_path], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(run.pid, 0)
    run.returncode = os.waitstatus_to_exitcode(status)
    assert run.returncode == 0
    assert forecast == pytest.approx(1024 * usage.ru_maxrss / 1e6, rel=0.25)
