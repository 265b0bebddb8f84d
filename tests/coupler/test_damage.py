"""Damage of groups of blocks: shares, first break, and the rules that make a state."""

import numpy as np
import pytest

from coupler.verdict.damage import NOWHERE, Blocks, Joints, Rules, State, damage

NEVER = np.nan
RULES = Rules(moved=0.1, damaged_joints=0.0, collapsed_weight=0.5)


def two_walls(moved=(0.0,) * 4, broken=(NEVER,) * 4, thickness=(1.0,) * 4, torn=(0.0,) * 4, rules=RULES):
    """Two walls of two blocks each, 1 m thick; joints: within either wall, between the two, and to the ground."""
    blocks = Blocks(np.array([1.0, 3.0, 2.0, 2.0]), np.array(thickness), np.array(moved))
    joints = Joints(
        np.array([0, 2, 1, 0]), np.array([1, 3, 2, -1]), np.array([1.0, 2.0, 4.0, 3.0]), np.array(broken),
        np.where(np.isfinite(broken), 1.0, torn),
    )  # fmt: skip
    return damage(np.array([0, 0, 1, 1]), ["left", "right"], blocks, joints, rules)


def test_what_nothing_happened_to_stands():
    for found in two_walls():
        assert (found.state, found.joints_broken, found.blocks_moved) == (State.STANDS, 0, 0)
        assert found.first_break is None


def test_a_crack_between_two_groups_is_damage_to_both():
    left, right = two_walls(broken=(NEVER, NEVER, 0.7, NEVER))
    assert left.state is right.state is State.DAMAGED
    assert left.area_broken == pytest.approx(4.0 / 8.0)  # of 1 + 4 + 3 m2
    assert right.area_broken == pytest.approx(4.0 / 6.0)
    assert left.first_joint == right.first_joint == 2


def test_a_joint_that_holds_by_one_edge_is_damage():
    """Its base torn over 2/3 of 3 m², of 1 + 4 + 3 m²: a wall that leans on its toe does not just stand."""
    left, right = two_walls(torn=(0.0, 0.0, 0.0, 2.0 / 3.0))
    assert (left.state, left.joints_broken, left.joints_torn) == (State.DAMAGED, 0, 1)
    assert left.area_torn == pytest.approx(2.0 / 8.0)
    assert left.rule == "25% of its joined area is torn, though no joint broke"
    assert (right.state, right.joints_torn) == (State.STANDS, 0)
    left, _ = two_walls(torn=(0.0, 0.0, 0.0, 2.0 / 3.0), rules=Rules(damaged_joints=0.3))
    assert (left.state, left.rule[:30]) == (State.STANDS, "25% of its joined area is torn")


def test_what_is_broken_and_what_is_torn_add_up():
    left, _ = two_walls(broken=(0.5, NEVER, NEVER, NEVER), torn=(0.0, 0.0, 0.0, 1.0 / 3.0))
    assert (left.joints_broken, left.joints_torn) == (1, 1)
    assert (left.area_broken, left.area_torn) == pytest.approx((1.0 / 8.0, 1.0 / 8.0))
    assert left.rule == "25% of its joined area is broken or torn"


def test_the_first_break_is_the_earliest_of_the_group():
    left, right = two_walls(broken=(2.0, 0.5, NEVER, 1.0))
    assert (left.first_break, left.first_joint) == (1.0, 3)
    assert (right.first_break, right.first_joint) == (0.5, 1)
    left, _ = two_walls(broken=(0.5, NEVER, NEVER, NEVER))
    assert (left.first_break, left.first_joint) == (0.5, 0)


def test_a_joint_with_the_ground_belongs_to_its_block_alone():
    """Row -1 must not be read as the last block."""
    left, right = two_walls(broken=(NEVER, NEVER, NEVER, 1.0))
    assert (left.joints_broken, right.joints_broken) == (1, 0)


def test_collapse_goes_by_the_weight_that_left_its_place_and_not_by_the_number_of_blocks():
    light = two_walls(moved=(0.2, 0.0, 0.0, 0.0))[0]
    heavy = two_walls(moved=(0.0, 0.2, 0.0, 0.0))[0]
    assert (light.state, heavy.state) == (State.DAMAGED, State.COLLAPSED)
    assert (light.weight_moved, heavy.weight_moved) == pytest.approx((0.25, 0.75))
    assert (light.farthest, light.farthest_block) == (0.2, 0)
    assert (heavy.farthest, heavy.farthest_block) == (0.2, 1)


def test_a_block_that_moved_less_than_the_share_of_its_thickness_is_in_its_place():
    assert two_walls(moved=(0.0, 0.099, 0.0, 0.0))[0].state is State.STANDS


def test_each_block_is_measured_by_its_own_thickness():
    """A way of 0.1 m takes a board of 0.2 m out of its place and leaves a block of 2 m in it."""
    left, right = two_walls(moved=(0.1, 0.1, 0.1, 0.1), thickness=(0.2, 2.0, 0.2, 0.2))
    assert (left.blocks_moved, left.weight_moved) == (1, pytest.approx(0.25))
    assert right.blocks_moved == 2


def test_broken_joints_alone_are_a_collapse_only_where_the_case_says_so():
    blocks, joints = (
        Blocks(np.ones(1), np.ones(1), np.zeros(1)),
        Joints(*map(np.array, ([0], [-1], [1.0], [0.3], [1.0]))),
    )
    label, names = np.zeros(1, int), ["wall"]
    assert damage(label, names, blocks, joints, Rules())[0].state is State.DAMAGED
    assert damage(label, names, blocks, joints, Rules(collapsed_joints=1.0))[0].state is State.COLLAPSED
    assert damage(label, names, blocks, joints, Rules(damaged_joints=1.0))[0].state is State.STANDS


def test_what_was_never_glued_is_moved_and_not_damaged():
    blocks = Blocks(np.ones(2), np.ones(2), np.array([0.5, 0.0]))
    found = damage(np.zeros(2, int), ["crates"], blocks, Joints.none(), RULES)[0]
    assert (found.word, found.state) == ("moved", State.COLLAPSED)


def test_blocks_of_no_group_count_nowhere():
    blocks = Blocks(np.ones(2), np.ones(2), np.array([0.0, 9.0]))
    found = damage(np.array([0, NOWHERE]), ["wall"], blocks, Joints.none(), RULES)[0]
    assert (found.blocks, found.blocks_moved) == (1, 0)
