"""What carries blocks at the start: parts that hang over the ground, and a ground that is not the floor of water."""

import copy

import pytest

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.checks.supports import support_remarks

WALL = {
    "case": {"title": "a wall before a column of water"},
    "time": {"end": 1.0},
    "tank": {"lower": [0, 0, 0], "upper": [8, 4, 3], "cell": 0.5},
    "water": {"fill": [{"lower": [0, 0, 0], "upper": [3, 4, 1.5]}]},
    "structure": {
        "ground": {"level": 0.0},
        "wall": [{"lower": [4, 0.5, 0], "size": [0.5, 3, 2], "block": [0.5, 1, 0.5]}],
    },
    "contact": {},
    "joints": {"strength": 2e5, "opening_at_failure": 2e-3},
}
DRY = {"joints": None, "contact": {"stiffness": 1e8}}


def made(foot=0.0, **sections):
    """The wall with its foot at this height [m]; sections that are None are left out."""
    table = copy.deepcopy(WALL)
    table["structure"]["wall"][0]["lower"][2] = foot
    table |= sections
    return Case.model_validate({name: part for name, part in table.items() if part is not None})


def grounded(level, foot, **sections):
    table = made(foot, **sections).model_dump(exclude_unset=True)
    table["structure"]["ground"] = {"level": level}
    return Case.model_validate(table)


@pytest.mark.parametrize("sections", [{}, DRY])
def test_a_wall_that_hangs_over_the_ground_is_remarked_on(sections):
    """5 mm of mortar that nobody modelled: no joint with the ground, and the wall overturns where it should stand."""
    (said,) = support_remarks(made(5e-3, **sections))
    assert "'wall' hangs 5 mm above what lies below it (z = 0 m)" in said
    assert not list(support_remarks(made(0.0, **sections)))


def test_a_wall_that_stands_loose_on_purpose_hangs_nowhere():
    pair = {"between": ["wall", "ground"], "joined": False}
    assert not list(support_remarks(made(joints={**WALL["joints"], "pair": [pair]})))


def test_a_wall_on_a_deck_that_hangs_on_nothing_itself_is_carried_by_it():
    deck = {"name": "deck", "centre": [4.25, 2, 0.8], "size": [2, 4, 0.4]}
    for sections in ({}, DRY):
        assert not list(support_remarks(made(1.0, solid=[deck], **sections)))
        assert "hangs 0.1 m" in next(iter(support_remarks(made(1.1, solid=[deck], **sections))))


def test_joined_barges_that_float_do_not_hang():
    barges = [
        {"name": f"b{i}", "centre": [1.0 + i, 2, 1.5], "size": [1, 1, 0.5], "density": 500.0}
        for i in range(2)
    ]
    afloat = made(structure={"block": barges})
    assert not list(support_remarks(afloat))
    heavy = made(structure={"block": [{**barge, "density": 1500.0} for barge in barges]})
    assert "'b0' hangs 1.25 m" in next(iter(support_remarks(heavy)))


def test_what_a_held_or_driven_block_carries_does_not_hang():
    pair = [{"name": f"b{i}", "centre": [5.0 + i, 2, 1.5], "size": [1, 1, 0.5]} for i in range(2)]
    for held, motion in (({"fixed": True}, []), ({}, [{"block": "b0", "velocity": [0, 0, 0.1]}])):
        case = made(structure={"block": [{**pair[0], **held}, pair[1]]}, motion=motion)
        assert not list(support_remarks(case))


def test_a_ground_below_the_floor_of_the_tank_is_refused():
    """It takes the place of the floor, through which the wall fell."""
    found = [text for path, text in problems(grounded(-0.5, 0.0)) if path == ("structure", "ground", "level")]
    assert len(found) == 1
    assert "below the floor of the tank (z = 0 m)" in found[0]
    assert not problems(grounded(0.0, 0.0))


def test_blocks_on_a_ground_that_water_flows_under_are_remarked_on():
    (said,) = support_remarks(grounded(0.5, 0.5))
    assert "stands on [structure.ground] at z = 0.5 m" in said
    assert "tank.lower[2] = 0.5" in said
    quay = {"name": "quay", "centre": [6, 2, 0.25], "size": [4, 4, 0.5]}
    assert not list(support_remarks(grounded(0.5, 0.5, solid=[quay])))


def test_a_ground_in_a_tank_without_its_corners_is_left_to_what_is_said_of_the_tank():
    assert problems(made(tank={"upper": [8, 4, 3]})) == []  # its missing keys are told where it is read
