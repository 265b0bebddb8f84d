"""Motions over time in a case: what is allowed, where they lead, and that a run goes on from a checkpoint with them."""

import shutil

import pytest

from coupler.checks.read_case import load
from coupler.commands.compare.plan import refuse
from coupler.geometry.parts import parts_of
from coupler.program.errors import BadCase
from coupler.run.checkpoint import FOLDER, listed
from tests.coupler.resumed import begin, check_same, go_on

CASE = """\
[case]
title = "a paddle"
[time]
end = "0.4 s"
step_max = "20 ms"
output_every = "0.1 s"
checkpoint_every = "0.2 s"
[tank]
lower = [0, 0, 0]
upper = [3, 0.6, 1]
cell = 0.2
smooth = ["y-", "y+"]
[[water.fill]]
lower = [0, 0, 0]
upper = [3, 0.6, 0.6]
[[structure.block]]
name = "paddle"
centre = [0.6, 0.3, 0.5]
size = [0.4, 0.6, 1]
[[structure.block]]
name = "crate"
centre = [1.9, 0.3, 0.6]
size = [0.3, 0.3, 0.3]
density = 500
[contact]
stiffness = "1 MN/m"
[[motion]]
block = "paddle"
"""
TABLE = 'times = [0, "0.1 s", "250 ms"]\nvelocities = [[0, 0, 0], ["20 cm/s", 0, 0], [-0.1, 0, 0]]\n'
FILE = "# a paddle, measured\ntime, velocity_x\n0, 0\n0.1, 0.2\n0.25, -0.1\n"


def write(tmp_path, text, record=FILE):
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "paddle.csv").write_text(record, encoding="utf-8")
    (tmp_path / "case.toml").write_text(CASE + text, encoding="utf-8")
    return tmp_path / "case.toml"


def mistakes(tmp_path, text, record=FILE):
    with pytest.raises(BadCase) as caught:
        load(write(tmp_path, text, record))
    return [line.removeprefix(str(tmp_path / "case.toml")) for line in caught.value.lines]


@pytest.mark.parametrize("text", [TABLE, 'path = "paddle.csv"\n'])
def test_a_table_and_a_file_tell_the_same(tmp_path, text):
    case = load(write(tmp_path, text)).case
    (block,) = (b for part in parts_of(case) for b in part.blocks if b.name == "paddle")
    assert block.driven
    assert block.motion.times.tolist() == [0.0, 0.1, 0.25]
    assert block.motion.velocities.tolist() == [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [-0.1, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("", "motion[0].block: 'paddle' moves with velocity, by times with velocities or displacements, or by the"),
        (TABLE + "velocity = [0, 0, 0]\n", "motion[0].velocity: 'paddle' moves with velocity, by times with"),
        (TABLE + "displacements = [[0, 0, 0]]\n", "it has times and velocities and displacements"),
        (
            "times = [0, 1]\ndisplacements = [[0.1, 0, 0], [0, 0, 0]]\n",
            "motion[0].displacements: the first displacement is [0.1, 0.0, 0.0] m; it must be zero",
        ),
        ("times = [0, 1]\n", "it has times"),
        ("times = [0, 1]\nvelocities = [[0, 0, 0]]\n", "motion[0].velocities: 1 velocities for 2 times"),
        ("times = [0]\nvelocities = [[0, 0, 0]]\n", "motion[0].times: 1 times; a motion over time needs two"),
        ("times = [1, 2]\nvelocities = [[0, 0, 0], [0, 0, 0]]\n", "the first time is 1 s; it must be 0"),
        (
            "times = [0, 2, 2]\nvelocities = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]\n",
            "motion[0].times: time 3 of 3 is 2 s, not after 2 s",
        ),
        ('times = [0, "1 m"]\nvelocities = [[0, 0, 0], [0, 0, 0]]\n', "1 m"),
        ('path = "padle.csv"\n', "no such file; did you mean 'paddle.csv'?"),
        ("velocites = [[0, 0, 0]]\n", "did you mean 'velocities'?"),
    ],
)  # fmt: skip
def test_motions_that_cannot_be_followed(tmp_path, text, reported):
    lines = mistakes(tmp_path, text)
    assert any(reported in line for line in lines)


@pytest.mark.parametrize(
    ("record", "reported"),
    [
        ("time, velocity_x\n0, 0\n0.2, 1\n0.1, 0\n", "paddle.csv: time 3 of 3 is 0.1 s, not after 0.2 s"),
        ("time, velocty_x\n0, 0\n0.2, 1\n", "unknown column 'velocty_x'; did you mean 'velocity_x'?"),
        ("time\n0\n0.2\n", "it needs the column time, and either one at least of velocity_x, velocity_y, velocity_z"),
        ("time, velocity_x, displacement_y\n0, 0, 0\n0.2, 1, 1\n", "it needs the column time, and either one at least"),
        ("velocity_x\n0\n0.2\n", "it needs the column time"),
        ("time, velocity_x\n0, a\n", "no table of numbers under a line of names"),
    ],
)  # fmt: skip
def test_files_of_motions_that_cannot_be_followed(tmp_path, record, reported):
    (line,) = mistakes(tmp_path, 'path = "paddle.csv"\n', record)
    assert "motion[0].path: " in line
    assert reported in line


@pytest.mark.parametrize(
    "text",
    [
        'times = [0, "0.1 s", "250 ms"]\ndisplacements = [[0, 0, 0], ["2 cm", 0, 0], [0.01, 0, 0]]\n',
        'path = "paddle.csv"\n',
    ],
)
def test_displacements_are_reached_at_their_times(tmp_path, text):
    record = "time, displacement_x\n0, 0\n0.1, 0.02\n0.25, 0.01\n"
    case = load(write(tmp_path, text, record)).case
    (block,) = (b for part in parts_of(case) for b in part.blocks if b.name == "paddle")
    for time, place in ((0.0, 0.0), (0.1, 0.02), (0.25, 0.01), (9.0, 0.01)):
        assert block.motion.way(time) == pytest.approx([place, 0.0, 0.0], abs=1e-15)
    assert block.motion.velocity(0.0).tolist() == block.motion.velocity(9.0).tolist() == [0.0, 0.0, 0.0]


def test_a_motion_that_turns_before_the_wall_is_allowed_and_one_that_passes_it_is_not(tmp_path):
    """It has 0.4 m of room before the side x-: with 8 m/s it would go 0.4 m until it turns."""
    there = "times = [0, 0.05, 0.1, 0.2]\nvelocities = [[0, 0, 0], [-{0}, 0, 0], [0, 0, 0], [{0}, 0, 0]]\n"
    assert load(write(tmp_path, there.format(7.9)))
    (line,) = mistakes(tmp_path, there.format(9.0))
    assert "motion[0].times: 'paddle' reaches the closed side x- of the tank (x = 0 m) at t = 0.0" in line


def test_a_run_with_a_motion_over_time_goes_on_bit_for_bit(tmp_path):
    """The file of the motion is one of those that a resumed run must find as they were."""
    write(tmp_path / "case", "", FILE)
    whole = begin(tmp_path / "case", CASE + 'path = "paddle.csv"\n', tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    go_on(part)
    check_same(whole, part)


def test_compare_refuses_a_motion_over_time(tmp_path):
    with pytest.raises(BadCase, match="drives blocks at one velocity"):
        refuse(load(write(tmp_path, TABLE)))
