"""Joints by pairs, random strengths and a gradual start, as a case asks for them."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.scene.build import build_structure

from .test_case_file import mistakes, write

TOWER = """
[case]
title = "tower"
[time]
end = 0.1
[structure]
{structure}
[structure.ground]
[[structure.block]]
name = "low"
centre = [0, 0, 0.5]
size = [1, 1, 1]
[[structure.block]]
name = "high"
centre = [0, 0, 1.5]
size = [1, 1, 1]
material = "brick"
[contact]
stiffness = 1e9
[joints]
strength = "1 MPa"
opening_at_failure = "1 mm"
{joints}
"""
RANDOM = 'distribution = "weibull"\nvariation = 0.3\nseed = {seed}'


def case_text(joints="", structure=""):
    return TOWER.format(joints=joints, structure=structure)


def laws(folder, joints):
    structure = build_structure(load(write(folder, case_text(joints))).case)
    with structure as s:
        return {
            s.names[a] + "-" + ("ground" if b < 0 else s.names[b]): law
            for a, b, law in zip(s.joints.a, s.joints.b, s.joints.laws)
        }


def test_a_pair_changes_what_it_says_and_nothing_else(tmp_path):
    found = laws(
        tmp_path,
        'law = "bilinear"\npeak = 0.2\n'
        '[[joints.pair]]\nbetween = ["brick", "low"]\nstrength = "2 kPa"\nlaw = "exponential"',
    )
    pair, rest = found["low-high"], found["low-ground"]
    assert (pair.strength, pair.opening_at_failure, pair.law, pair.peak_share) == (
        2e3,
        1e-3,
        "exponential",
        0.1,
    )
    assert (rest.strength, rest.law, rest.peak_share) == (1e6, "bilinear", 0.2)
    assert list(laws(tmp_path, '[[joints.pair]]\nbetween = ["ground", "low"]\njoined = false')) == [
        "low-high"
    ]


HOUSE = """
[case]
title = "house on a plinth"
[time]
end = 0.1
[structure]
[structure.ground]
[[structure.building]]
name = "house"
lower = [0, 0, 0]
size = [4, 4, 3]
wall_thickness = 0.5
block = [1, 1]
[[structure.wall]]
name = "garden"
lower = [10, 0, 0]
size = [3, 0.5, 1]
block = [1, 0.5, 1]
[contact]
stiffness = 1e9
[joints]
strength = "1 MPa"
opening_at_failure = "1 mm"
[[joints.pair]]
"""


def on_the_ground(folder, pair):
    """Names of the tables with joints to the ground, and the number of all joints."""
    with build_structure(load(write(folder, HOUSE + pair)).case) as s:
        return {s.names[a].partition("-")[0] for a, b in zip(s.joints.a, s.joints.b) if b < 0}, len(s.joints)


def test_a_pair_takes_the_name_of_a_building(tmp_path):
    """Its blocks have the groups wall, floor and roof, and the garden wall keeps its joints to the ground."""
    every, count = on_the_ground(tmp_path, 'between = ["roof", "ground"]\njoined = false')
    assert every == {"house", "garden"}
    found, fewer = on_the_ground(tmp_path, 'between = ["house", "ground"]\njoined = false')
    assert found == {"garden"}
    assert fewer < count
    found, fewer = on_the_ground(tmp_path, 'between = ["house", "house"]\njoined = false')
    assert found == {"house", "garden"}
    assert fewer < 0.5 * count
    (line,) = mistakes(tmp_path, HOUSE + 'between = ["hous", "ground"]\njoined = false')
    assert "nothing is called 'hous'; did you mean 'house'?" in line


def test_random_strengths_are_those_of_the_seed(tmp_path):
    one, again, other = (
        [law.strength for law in laws(tmp_path, RANDOM.format(seed=seed)).values()] for seed in (1, 1, 2)
    )
    assert one == again != other
    assert np.ptp(one) > 0.0


@pytest.mark.parametrize(
    ("joints", "structure", "says"),
    [
        ('[[joints.pair]]\nbetween = ["hihg", "low"]', "", "nothing is called 'hihg'; did you mean 'high'?"),
        (
            '[[joints.pair]]\nbetween = ["high", "low"]\nlaw = "bilinaer"',
            "",
            "no law 'bilinaer'; did you mean 'bilinear'?",
        ),
        ('[[joints.pair]]\nbetween = ["high", "low"]\npeak = 0.5', "", "joints.peak = 0.5"),
        ('distribution = "weibull"', "", "joints.distribution"),
        ("variation = 0.2", "", "joints.variation"),
        ('distribution = "weibull"\nvariation = "2 m"', "", "variation"),
        ("", 'start = "ramp"', "needs the time over which the weight comes on"),
        ("", "ramp = 1.0", "is for start = 'ramp', not 'settled'"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_key(tmp_path, joints, structure, says):
    assert any(says in line for line in mistakes(tmp_path, case_text(joints, structure)))


def test_a_ramp_reaches_the_structure(tmp_path):
    text = case_text(structure='start = "ramp"\nramp = "2 s"')
    with build_structure(load(write(tmp_path, text)).case) as s:
        assert np.abs(s.weight_now()).max() == 0.0


def test_what_lies_on_a_joined_block_without_a_joint_rests_there_from_the_start(tmp_path):
    """A house that stands on footings glued to the ground, but is not glued to them, must not fall through them until
    it has left its place."""
    third = '[[structure.block]]\nname = "top"\ncentre = [0, 0, 2.5]\nsize = [1, 1, 1]\n[contact]'
    pair = '[[joints.pair]]\nbetween = ["low", "high"]\njoined = false'
    text = case_text(pair, 'start = "sudden"').replace("[contact]", third)
    with build_structure(load(write(tmp_path, text)).case) as s:
        weight = 9.81 * s.mass[1:].sum()
        s.advance(0.02)
        sunk = 1.5 - s.centre()[1, 2]
        assert 0.0 < sunk < 4.0 * weight / 1e9
