"""The forecast of `check` against what a run takes."""

import re
import subprocess
import sys

import pytest

from coupler.checks.read_case import load
from coupler.run import cost
from coupler.run.forecast import forecast

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


HOUSE = (
    WATER
    + """
[structure]
[[structure.wall]]
name = "wall"
lower = [0.6, 0.1, 0]
size = [0.05, 0.3, 0.4]
block = [0.05, 0.1, 0.1]
[contact]
[joints]
strength = "0.2 MPa"
opening_at_failure = "0.2 mm"
"""
)
BORE = """
[[water.inflow]]
kind = "bore"
side = "x-"
ahead = 0.2
level = 0.4
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
def test_the_memory_and_the_disk_that_are_forecast_are_what_a_run_takes(tmp_path, text):
    """Within a quarter, small scenes: memory is that of the programs and their kernels, the disk holds two checkpoints
    above all, three states and the histories.

    The first of the two runs compiles what is not compiled yet, which takes a gigabyte more."""
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    assert said("run", tmp_path).returncode == 0
    checked = said("check", tmp_path).stdout
    forecast, disk = (float(re.search(rf"{name} +([\d.]+) MB", checked)[1]) for name in ("memory", "disk"))
    written = sum(path.stat().st_size for path in (tmp_path / "runs").rglob("*") if path.is_file())
    assert disk == pytest.approx(written / 1e6, rel=0.25)
    run = subprocess.run(
        [sys.executable, "-c", PEAK, *COMMAND, "run", tmp_path], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert forecast == pytest.approx(float(run.stdout), rel=0.25)


def seconds_of(place, text):
    (place / "case.toml").write_text(text, encoding="utf-8")
    return forecast(load(place).case)["processor time"]


def test_more_water_and_walls_that_rub_take_longer(tmp_path):
    """A step is forecast from the water, not from the tank alone: a channel half full, with Manning's friction, took
    three times what was said."""
    text = WATER.replace("output_every = 0.025", "output_every = 0.05").replace("end = 0.05", "end = 5")
    full = text.replace("upper = [0.4, 0.5, 0.3]", "upper = [1, 0.5, 0.3]")
    rubbed = full.replace("[[water.fill]]", '[water]\nwalls = "friction"\nmanning = 0.02\n[[water.fill]]', 1)
    plain, more, most = (seconds_of(tmp_path, scene) for scene in (text, full, rubbed))
    assert plain < more < most


def test_water_that_a_bore_brings_counts_by_half(tmp_path):
    """It comes in over the run: half way between 0.2 m and 0.4 m, which is 0.6 of the tank."""
    (tmp_path / "case.toml").write_text(
        WATER.replace("upper = [0.4, 0.5, 0.3]", "upper = [1, 0.5, 0.2]") + BORE
    )
    case = load(tmp_path).case
    assert cost.wet_cells(case, 1000) == pytest.approx(cost.SPREAD * 600.0)


def test_stones_take_longer_than_boxes_as_they_have_more_nodes_and_faces(tmp_path):
    boxes = BLOCK.replace("centre = [0.7, 0.25, 0.1]", "centre = [0.7, 0.25, 0.11]")
    stones = boxes.replace("size = [0.2, 0.2, 0.2]", "diameter = 0.2")
    dry = WATER[: WATER.index("[[water.fill]]")].replace("end = 0.05", "end = 1")
    box, stone = (seconds_of(tmp_path, dry + text) for text in (boxes, stones))
    assert stone > 1.2 * box


def test_a_step_ends_at_each_written_state(tmp_path):
    """Steps of 10 ms at most between states 25 ms apart are three each: six, and not five."""
    (tmp_path / "case.toml").write_text(WATER, encoding="utf-8")
    assert forecast(load(tmp_path).case)["steps"] == 6


def test_a_step_takes_one_substep_at_least(tmp_path):
    """A box alone may take 0.8 ms a substep; steps of 0.1 ms are 500, and 63 substeps were forecast for them."""
    text = (WATER + BLOCK).replace("step_max = 0.01", "step_max = 1e-4")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    found = forecast(load(tmp_path).case)
    assert found["steps"] == 500
    assert found["substeps"] == 500


def test_sleep_is_named_where_substeps_take_most_of_a_run(tmp_path):
    (tmp_path / "case.toml").write_text(HOUSE, encoding="utf-8")
    (said,) = forecast(load(tmp_path, ["time.end=20 s"]).case).remarks
    assert "[structure.sleep]" in said
    for less in (
        ["time.end=0.1 s"],
        ["time.end=20 s", "structure.sleep={}"],
        ["time.end=20 s", "water=absent"],
    ):
        assert not forecast(load(tmp_path, less).case).remarks
