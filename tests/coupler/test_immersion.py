"""Blocks as the water sees them: faces that joints seal reach over the gap between the blocks."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupler.step.immersion import STILL, Immersion
from fluid.mesh.background import box_mesh
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

CELL = 0.25


@pytest.mark.parametrize("gap", [0.0, 0.5, 0.95, 2.9])
def test_sealed_faces_reach_beyond_a_block_that_has_moved_since_it_was_cut(gap):
    """A joint opens by `gap` times the distance within which a block counts as not moved: each face still overlaps the
    place of the other one, and that by the whole distance."""
    still = STILL * CELL
    blocks = [Block(name, (0.5, 0.5, z), size=0.3) for name, z in (("low", 0.35), ("high", 0.65))]
    with Structure(blocks, None, JointParameters(1e6, 0.1, damping=0.0), gravity=(0, 0, 0)) as s:
        immersion = Immersion(box_mesh((0, 0, 0), (1, 1, 1), CELL), s, [], "single")
        s.displace(np.array([1]), np.array([[0.0, 0.0, gap * still]]), np.eye(3)[None])
        immersion.update()
        bodies, (block, face, _) = immersion.bodies, s.joined_planes()
        plane = bodies.plane_start[block] + face
        reaches = (bodies.offsets + bodies.growth)[plane] * bodies.normals[plane, 2]
        assert reaches[0] >= 0.5 + gap * still + still * (1 - 1e-9)
        assert reaches[1] <= 0.5 + still * 1e-9 - still + (gap * still if gap > 1.0 else 0.0)


def test_a_sealed_face_that_comes_back_keeps_what_it_reached():
    """A joint that opens and closes: its faces reach as far as before, so that nothing is cut again for it."""
    blocks = [Block(name, (0.5, 0.5, z), size=0.3) for name, z in (("low", 0.35), ("high", 0.65))]
    up = np.array([[0.0, 0.0, 3.0 * STILL * CELL]])
    with Structure(blocks, None, JointParameters(1e6, 0.1, damping=0.0), gravity=(0, 0, 0)) as s:
        immersion = Immersion(box_mesh((0, 0, 0), (1, 1, 1), CELL), s, [], "single")
        sealed = immersion.bodies.growth > 0.0
        s.displace(np.array([1]), up, np.eye(3)[None])
        immersion.update()
        reached = immersion.bodies.growth.copy()
        s.displace(np.array([1]), -up, np.eye(3)[None])
        immersion.update()
        assert sealed.sum() == 2
        assert (reached[sealed] > 2.0 * STILL * CELL).all()
        np.testing.assert_array_equal(immersion.bodies.growth, reached)


def test_only_a_loose_block_is_drawn_in_where_it_stands_on_another():
    """Three blocks in a row on a slab that no joint holds them to: two are joined to each other, one is alone. The lone
    one is drawn in by a film, by which water reaches the faces that rest on something. The joined ones have their sizes
    to the last bit: films around each of them would take from the volume, hence from the buoyancy, of a building."""
    blocks = [Block("slab", (1.0, 0.5, 0.1), size=(1.6, 0.6, 0.2), fixed=True)]
    blocks += [Block(name, (x, 0.5, 0.4), size=(0.4, 0.4, 0.4)) for name, x in (("a", 0.5), ("b", 0.9))]
    blocks += [Block("alone", (1.5, 0.5, 0.4), size=(0.4, 0.4, 0.4))]
    joints = JointParameters(1e6, 0.1, damping=0.0)
    with Structure(blocks, ContactLaw(1e8), joints, gravity=(0, 0, 0)) as s:
        names = list(s.names)
        to_slab = (s.joints.a == 0) | (s.joints.b == 0)
        s.joints.largest[to_slab[s.joints.joint_of]] = 10.0  # wide open: they fail
        s.advance(1e-5)
        immersion = Immersion(box_mesh((0, 0, 0), (2, 1, 1), CELL), s, [], "single")
        bodies, (block, _, _) = immersion.bodies, s.joined_planes()
        assert {names[b] for b in block} == {"a", "b"}
        for name in ("a", "b", "alone"):
            own = slice(*bodies.plane_start[[names.index(name), names.index(name) + 1]])
            growth = bodies.growth[own]
            if name == "alone":
                assert (growth < 0.0).all()
            else:
                assert (growth > 0.0).sum() == 1
                assert (growth == 0.0).sum() == len(growth) - 1


def test_a_block_that_has_left_its_place_has_no_film_there_before_and_after_a_restart():
    """A block stands on the ground at the start, where a film lies under it though its contact has yet to begin. Where
    it hangs later nothing touches it. Its place at the start was once that where it was last cut, so that it kept the
    film, until a restart took it away."""
    away = np.array([[0.7, 0.0, 0.3]])

    def scene():
        return Structure(
            [Block("b", (0.5, 0.5, 0.2), size=0.4)], ContactLaw(1e8), ground=0.0, gravity=(0, 0, 0)
        )

    mesh = box_mesh((0, 0, 0), (2, 1, 1), CELL)
    with scene() as s:
        immersion = Immersion(mesh, s, [], "single")
        assert immersion.bodies.growth.min() < 0.0
        s.displace(np.array([0]), away, np.eye(3)[None])
        for _ in range(2):
            immersion.update()
            assert immersion.bodies.growth.min() == 0.0
        saved, moved = immersion.save(), s.save()
    with scene() as s:
        resumed = Immersion(mesh, s, [], "single")
        s.restore(moved)
        resumed.restore(saved)
        assert not resumed.update()


FINE = np.array([*np.arange(0.0, 1.01, CELL), 1.05, 1.1])
"""Axis whose cells are a fifth as long at its upper end."""


def growths(axes, block, contact, moved=(0.0, 0.0, 0.0)):
    """Shift of the faces of a block on the ground, -x +x -y +y -z +z [m], after it has moved."""
    with Structure([block], contact, None, ground=0.0, gravity=(0, 0, 0)) as s:
        immersion = Immersion(box_mesh(None, None, axes=axes), s, [], "single")
        s.displace(np.array([0]), np.array([moved]), np.eye(3)[None])
        immersion.update()
        return immersion.bodies.growth


@pytest.mark.parametrize("top", [np.arange(0.0, 1.01, CELL), FINE])
def test_films_go_by_the_cells_around_the_block(top):
    """A block that has sunk into the ground by 0.04 of its cells is open to water below, however fine the cells are
    above it: closed, it lost its buoyancy."""
    even, depth = np.arange(0.0, 2.01, CELL), 0.04 * CELL
    block = Block("b", (1.0, 1.0, 0.25), size=0.5)
    below = growths((even, even, top), block, ContactLaw(1e6), moved=(0.0, 0.0, -depth))[4]
    assert below <= -depth


@pytest.mark.parametrize("top", [np.arange(0.0, 1.01, CELL), FINE])
def test_a_slice_closes_the_tank_by_the_cells_around_it(top):
    gap = 0.016 * CELL
    block = Block("slice", (1.0, 0.5, 0.25), size=(0.5, 1.0 - 2.0 * gap, 0.5))
    axes = np.arange(0.0, 2.01, CELL), np.arange(0.0, 1.01, CELL), top
    assert (growths(axes, block, ContactLaw(1e6))[2:4] > gap).all()


def test_places_of_an_uplift_turn_with_their_block():
    """Where a joint lets a share of the pressure in is known in the frame of the block when it was last cut."""
    quarter = Rotation.from_rotvec([0.0, 0.0, 0.5 * np.pi]).as_matrix()
    shares = np.array([0]), np.array([1]), np.array([[0.2, 0.0, -0.1]]), np.array([0.4])
    of = SimpleNamespace(
        structure=SimpleNamespace(
            blocks=[Block("b", (1.0, 2.0, 3.0), size=0.4)], uplift_shares=lambda: shares
        ),
        n_solids=1,
        _centre=np.array([[1.0, 2.0, 3.0]]),
        _rotation=quarter[None],
        _reference=SimpleNamespace(plane_start=np.array([0, 6])),
    )
    loose, wet = Immersion.films(of)
    assert loose.tolist() == [True, False]
    _, place, share = wet
    np.testing.assert_allclose(place, [[1.0, 2.2, 2.9]])
    np.testing.assert_array_equal(share, [0.4])
