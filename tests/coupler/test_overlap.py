"""Contacts too soft for their blocks: a remark before the run, and an end with the names during it."""

import subprocess
import sys

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.checks.softness import softness_remarks
from coupler.geometry.overlaps import deepest_overlap
from coupler.program.errors import ExitCode
from coupler.scene.build import build
from coupler.step.limits import Diverged, check_overlap
from tests.fakes import no_clock
from tests.physics.scenes import case
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

from .test_case_file import write

SOFT = """
[case]
title = "plate that falls"
[time]
end = 0.5
output_every = 0.1
[structure]
density = 2000.0
[structure.ground]
[[structure.block]]
name = "plate"
centre = [0, 0, 0.25]
size = [1.0, 1.0, 0.1]
[contact]
stiffness = {stiffness}
"""


@pytest.mark.parametrize(("stiffness", "soft"), [("1e5", True), ("1e8", False)])
def test_a_soft_contact_is_remarked_and_ends_the_run(tmp_path, stiffness, soft):
    """200 kg from 0.2 m: v sqrt(m/K) is 0.9 of the plate, or 0.03 of it."""
    path = write(tmp_path, SOFT.format(stiffness=stiffness))
    reported = [text for text in remarks(load(path).case) if "too soft" in text]
    assert [("'plate', 0.1 m thick" in text) for text in reported] == ([True] if soft else [])
    program = "import sys; sys.argv[0] = 'surgebreak'; from coupler.commands.cli import main; main()"
    command = [sys.executable, "-c", program, "run", str(path), "--output", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == (ExitCode.DIVERGED if soft else 0), done.stderr
    if soft:
        assert "'plate' is" in done.stderr
        assert "deep in the ground" in done.stderr
        assert "limits.overlap" in done.stderr


@pytest.mark.parametrize(("quay", "fall"), [(5.0, 0.0), (2.0, 8.0)])
def test_blocks_fall_to_what_lies_below_them(quay, fall):
    """A crate that rests on a quay 8 m high, or lies 8 m above the floor beside it, and a stack of nine beside that:
    the floor of the tank was where each of them would land."""

    def crate(name, x, z):
        return {"name": name, "size": [1, 1, 1], "centre": [x, 1, z]}

    blocks = [crate("crate", 5, 8.5), *(crate(f"c{i}", 8, 0.5 + i) for i in range(9))]
    found = case(
        time={"end": 1},
        tank={"lower": [0, 0, 0], "upper": [10, 2, 12], "cell": 0.5},
        solid=[{"centre": [quay, 1, 4], "size": [2, 2, 8]}],
        structure={"block": blocks, "density": 2400.0},
        contact={"stiffness": 3e6},
    )
    reported = list(softness_remarks(found))
    assert [("'crate'" in text, f"{np.sqrt(2 * 9.81 * fall):.3g} m/s" in text) for text in reported] == (
        [(True, True)] if fall else []
    )


WET = """
[tank]
lower = [-2, -2, 0]
upper = [2, 2, 4]
cell = 0.5
[[water.fill]]
lower = [-2, -2, 0]
upper = [2, 2, 2]
"""


@pytest.mark.parametrize(
    ("density", "z", "falls"), [(500.0, 2.0, False), (2500.0, 2.0, True), (500.0, 3.0, True)]
)
def test_what_floats_does_not_fall_to_the_floor(tmp_path, density, z, falls):
    """A barge at its draught was to land at 5.6 m/s; one that sinks or is dropped may strike the floor."""
    text = SOFT.format(stiffness=1e5).replace("density = 2000.0", f"density = {density}")
    path = write(tmp_path, text.replace("centre = [0, 0, 0.25]", f"centre = [0, 0, {z}]") + WET)
    assert any("too soft" in text for text in remarks(load(path).case)) == falls


def test_crossed_edges_are_measured_by_the_way_that_parts_them():
    """A ridge that sinks 0.02 m into a ridge lies far behind its faces; the way out is short."""
    from scipy.spatial.transform import Rotation

    low, high = (Rotation.from_euler(axis, 45, degrees=True).as_matrix() for axis in "xy")
    blocks = [
        Block("low", (0, 0, 0), size=1.0, rotation=low, fixed=True),
        Block("high", (0, 0, 2**0.5 + 1e-4), size=1.0, rotation=high, velocity=(0, 0, -1.0)),
    ]
    with Structure(blocks, ContactLaw(1e9, 0.3, 0.0), gravity=(0, 0, 0)) as s:
        s.advance(1.1e-3)
        found = deepest_overlap(s, 1e-5)
        depth = 2**0.5 - s.centre()[1, 2]
    assert (found.block, found.other) == ("low", "'high'")
    assert found.depth == pytest.approx(depth, rel=1e-5)
    assert found.share == pytest.approx(found.depth, rel=1e-9)
    with pytest.raises(Diverged, match=r"'low' is .* deep in 'high'"):
        check_overlap(1.0, found, 1e-4)


def test_a_joint_that_closes_too_far_counts():
    from yade_scripts.joints.cohesion import JointParameters

    blocks = [Block("low", (0, 0, 0.5), size=1.0), Block("high", (0, 0, 1.5), size=1.0, density=2000.0)]
    with Structure(blocks, ContactLaw(), JointParameters(1e3, 0.1, damping=0.0), ground=0.0) as s:
        s.advance(1.0)
        found = deepest_overlap(s, 0.1)
    assert found.other in ("'high'", "the ground")
    assert found.share > 0.1
    assert found.joined


def test_one_block_between_the_sides_of_a_tank(tmp_path):
    """More planes than blocks: the floor, the last of five, was looked for among the blocks."""
    tank = 'tank = { lower = [-1, -1, 0], upper = [1, 1, 2], cell = 0.5, open = ["z+"] }\n'
    text = tank + SOFT.format(stiffness="1e8").replace("0.25]", "0.05]\nvelocity = [0, 0, -1]").replace(
        "[structure.ground]\n", ""
    )
    structure = build(load(write(tmp_path, text)).case, no_clock).coupling.structure
    try:
        structure.advance(1e-4)
        a, b, depth, share, joined = structure.deepest()
        assert a.tolist() == [0] * len(a)
        assert (b < 0).all()
        assert not joined.any()
        assert share == pytest.approx(depth / 0.1)
        assert share.max() == pytest.approx(1e-3, rel=0.2)
    finally:
        structure.close()


@pytest.mark.parametrize(("share", "soft"), [(0.9, False), (1.1, True)])
def test_the_lowest_course_of_a_wall_carries_all_those_above(share, soft):
    """Ten courses of which each alone would press itself in by a tenth of what is too much."""
    wall = {"name": "wall", "lower": [0, 0, 0], "size": [0.5, 0.2, 2.0], "block": [0.5, 0.2, 0.2]}
    limit, weight = 0.1, 10 * 2000.0 * 0.5 * 0.2 * 0.2 * 9.81
    found = case(
        time={"end": 1},
        structure={"wall": [wall], "density": 2000.0, "ground": {}},
        contact={"stiffness": weight / (share * limit * 0.2)},
        limits={"overlap": limit},
    )
    assert len(list(softness_remarks(found))) == soft
