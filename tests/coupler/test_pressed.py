"""The pressure across a block is that across its wall or slab, whatever the shape of the single block."""

import numpy as np
import pytest

from coupler.verdict.pressed import Pressed
from yade_scripts.blocks.block import Block

PUSH = 1e4
"""Force of the water on each block [N]."""


def boxes(*placed, rotation=None):
    """Blocks of (size, centre), all turned about the origin."""
    turn = np.eye(3) if rotation is None else rotation
    return [
        Block(str(k), turn @ np.array(centre, float), np.array(size, float), density=2000.0, rotation=turn)
        for k, (size, centre) in enumerate(placed)
    ]


def pressure(blocks, direction, label=None):
    """Pressures under the same force along a direction on every block of one group."""
    own = np.zeros(len(blocks), int) if label is None else np.array(label)
    return Pressed.of(blocks, own).pressure(PUSH * np.array([direction] * len(blocks), float))


def wall(size, nz=4, ny=5):
    """Blocks of a wall along y."""
    return [(size, (0, (j + 0.5) * size[1], (k + 0.5) * size[2])) for j in range(ny) for k in range(nz)]


@pytest.mark.parametrize("size", [(0.4, 0.8, 0.5), (0.4, 0.8, 0.2), (0.4, 0.3, 0.5)])
def test_the_pressure_on_a_wall_is_that_across_it_also_where_its_blocks_are_low_or_short(size):
    """Blocks lower or shorter than the wall is thick: a force across the wall was divided by none of their faces."""
    blocks = boxes(*wall(size))
    assert pressure(blocks, (1, 0, 0)) == pytest.approx(PUSH / (size[1] * size[2]))
    assert pressure(blocks, (0, 1, 0)) == pytest.approx(0.0, abs=1e-9)
    assert pressure(blocks, (0, 0, 1)) == pytest.approx(0.0, abs=1e-9)


def test_a_wall_at_an_angle_is_the_same_wall():
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    blocks = boxes(*wall((0.4, 0.8, 0.2)), rotation=turn)
    assert pressure(blocks, turn[:, 0]) == pytest.approx(PUSH / 0.16)
    assert pressure(blocks, turn[:, 1]) == pytest.approx(0.0, abs=1e-9)


def test_a_slab_counts_what_lifts_it():
    blocks = boxes(*[((1, 1, 0.2), (i, j, 3)) for i in range(4) for j in range(4)])
    assert pressure(blocks, (0, 0, 1)) == pytest.approx(PUSH)
    assert pressure(blocks, (1, 0, 0)) == pytest.approx(0.0)


def test_a_row_of_caissons_shorter_than_they_are_thick_counts_the_face_towards_the_sea():
    """2.5 m thick, 2 m along the quay, 4 m high: the bore pressed with 89 kPa, and 14 were said."""
    blocks = boxes(*[((2.5, 2, 4), (0, 1 + 2 * j, 2)) for j in range(3)])
    assert pressure(blocks, (1, 0, 0)) == pytest.approx(PUSH / 8.0)


def test_loose_blocks_count_the_larger_of_both_sides_and_no_buoyancy():
    """Containers lie apart and are lower than wide: neither a slab nor a wall."""
    blocks = boxes(((2.4, 6, 2.2), (20, 5, 4)), ((2.4, 6, 2.2), (24, 5, 4)))
    assert pressure(blocks, (1, 0, 0)) == pytest.approx(PUSH / (6 * 2.2))
    assert pressure(blocks, (0, 1, 0)) == pytest.approx(PUSH / (2.4 * 2.2))
    assert pressure(blocks, (0, 0, 1)) == pytest.approx(0.0)
    assert pressure(blocks, (1, 0, 0), label=[-1, -1]) == pytest.approx(PUSH / (6 * 2.2))


def on_a_sphere(rng):
    x = rng.normal(size=(12, 3))
    return x / np.linalg.norm(x, axis=1)[:, None]


def test_many_stones_are_taken_one_by_one():
    rng = np.random.default_rng(1)
    stones = [Block(str(k), np.array([3.0 * k, 0.0, 1.0]), vertices=on_a_sphere(rng)) for k in range(8)]
    found = pressure(stones, (1, 0, 0))
    assert (found > 0.0).all()
    assert found == pytest.approx(pressure(stones, (1, 0, 0), label=[-1] * 8))
