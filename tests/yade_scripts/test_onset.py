"""When a block of an intact structure begins to meet what it is not joined to."""

from types import SimpleNamespace

import numpy as np
import pytest

from yade_scripts.dynamics.onset import STANDS, ContactOnset

RADIUS = np.array([1.0, 2.0, 0.5])


def standing():
    """Three blocks at rest, none of them loose, and how they move."""
    motion = SimpleNamespace(x=np.zeros((3, 3)), R=np.array([np.eye(3)] * 3))
    return ContactOnset(SimpleNamespace(), motion, None, None, RADIUS, np.zeros(3, bool)), motion


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_blocks_that_stand_are_not_loosened():
    onset, _ = standing()
    assert len(onset.moved()) == 0


@pytest.mark.parametrize(("share", "found"), [(0.9, []), (1.1, [1])])
def test_a_block_leaves_its_place_by_a_share_of_its_radius(share, found):
    onset, motion = standing()
    motion.x[1, 2] = share * STANDS * RADIUS[1]
    assert onset.moved().tolist() == found


@pytest.mark.parametrize(("share", "found"), [(0.9, []), (1.1, [2])])
def test_a_block_that_turns_on_the_spot_leaves_its_place(share, found):
    """Its edge goes as far as its centre would."""
    onset, motion = standing()
    motion.R[2] = turned(share * STANDS)
    assert onset.moved().tolist() == found


def test_moving_and_turning_add_up_and_new_places_count_from_there():
    onset, motion = standing()
    motion.x[0, 0], motion.R[0] = 0.6 * STANDS * RADIUS[0], turned(0.6 * STANDS)
    assert onset.moved().tolist() == [0]
    onset.rest_here()
    assert len(onset.moved()) == 0
