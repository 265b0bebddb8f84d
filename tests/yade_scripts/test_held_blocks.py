"""Fixed blocks have no joints among themselves; faces that lie on one another may keep water out."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.seals import Seals

GLUE = JointParameters(1e6, 1e-3, damping=0.0)


def row_of(count, **more):
    """Cubes of 1 m in a row on the ground, one of them free."""
    return [Block(f"b{i}", (float(i), 0, 0.5), size=1.0, **({} if i == 2 else more)) for i in range(count)]


def test_fixed_blocks_are_joined_to_free_ones_alone():
    """Of four in a row and the ground, the free one has its two neighbours and the ground; what is held has nothing
    else."""
    with Structure(row_of(4, fixed=True), ContactLaw(), GLUE, ground=0.0) as s:
        table = s.joint_table()
        assert sorted(zip(table.a.tolist(), table.b.tolist())) == [(1, 2), (2, -1), (2, 3)]
        block, face, _ = s.joined_planes()
        assert len(block) == 2 + 1 + 2 + 2 + 3  # two faces b1-b2, b2-b3, b0-b1; ground under four: once each
        assert len(set(zip(block.tolist(), face.tolist()))) == len(block)
        assert not s.loose()[[0, 1, 3]].any()


def test_a_driven_block_is_joined_to_a_fixed_one_since_they_may_part():
    blocks = [
        Block("low", (0, 0, 0.5), size=1.0, fixed=True),
        Block("high", (0, 0, 1.5), size=1.0, driven=True),
    ]
    with Structure(blocks, ContactLaw(1e8), GLUE, ground=0.0) as s:
        assert s.joint_table().b.tolist() == [1]


def test_a_driven_block_that_leaves_opens_what_it_sealed():
    blocks = [
        Block("low", (0, 0, 0.5), size=1.0, fixed=True),
        Block("high", (0, 0, 1.5), size=1.0, driven=True, velocity=(0, 0, 0.1)),
    ]
    with Structure(blocks, ContactLaw(1e8, uplift=0.0), gravity=(0, 0, 0)) as s:
        assert len(s.joined_planes()[0]) == 2
        s.advance(0.05)
        assert len(s.joined_planes()[0]) == 2
        s.advance(0.1)
        assert len(s.joined_planes()[0]) == 0


@pytest.mark.parametrize(("uplift", "closed"), [(1.0, 0), (0.5, 0), (0.0, 3)])
def test_loose_blocks_seal_where_that_is_asked_for(uplift, closed):
    """A cube on another on the ground: both faces between them and the one below, until the upper one is pushed off."""
    blocks = [Block("low", (0, 0, 0.5), size=1.0), Block("high", (0, 0, 1.5), size=1.0)]
    with Structure(blocks, ContactLaw(1e8, uplift=uplift), ground=0.0) as s:
        s.advance(0.1)
        assert len(s.joined_planes()[0]) == closed
        s.displace(np.array([1]), np.array([[0.6, 0.0, 0.0]]), np.eye(3)[None])
        assert len(s.joined_planes()[0]) == closed // 3


def test_what_a_load_does_to_a_driven_block_goes_to_what_drives_it():
    """0.1 m/s against 3 N for 0.5 s: the load does -0.15 J, the drive puts in as much."""
    block = Block("b", (0, 0, 2.0), size=0.2, driven=True, velocity=(0.0, 0.0, 0.1))
    with Structure([block]) as s:
        s.set_load(np.array([[2.0, 0.0, -3.0, 0.0, 0.0, 0.0]]))
        s.advance(0.5)
        energies = s.energies()
    assert energies["load_work"] == pytest.approx(-0.15)
    assert energies["driving_work"] == pytest.approx(0.15)


def test_faces_that_have_opened_on_one_side_are_sealed_to_half_of_that():
    """Lifted by 4 mm on one edge of 1 m: both faces are drawn out by 2 mm."""
    blocks = [Block("low", (0, 0, 0.5), size=1.0), Block("high", (0, 0, 1.5), size=1.0)]
    seals = Seals(blocks, touching_faces(blocks))
    angle = 4e-3
    turn = np.array([[1.0, 0.0, angle], [0.0, 1.0, 0.0], [-angle, 0.0, 1.0]])
    x = np.array([[0.0, 0.0, 0.5], [0.5 * -angle + 0.5 * angle, 0.0, 1.5 + 0.5 * angle]])
    rows, _, half = seals.closed_faces(x, np.array([np.eye(3), turn]))
    assert sorted(rows.tolist()) == [0, 1]
    np.testing.assert_allclose(half, 0.5 * angle, rtol=1e-3)
