"""Boxes are kept apart by their half edges: the same bits as by their vertices and faces, and no contact is missed. Nor
is one missed among the nodes that are far from the faces of the other block."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from kernels.decorators import kernel
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.rubble import rubble_blocks
from yade_scripts.contact import forces
from yade_scripts.contact.boxes import between_boxes, planes_of_box
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.nodes import contact_shapes
from yade_scripts.contact.search import planes_seen_from, separation
from yade_scripts.dynamics.structure import Structure
from yade_scripts.yade_side import scene


@kernel
def both_ways(shapes, a, b, x, R):
    """By vertices and by half edges: planes (2, 2, 6, 4), distances (2, 2) and faces (2, 2) of both directions."""
    planes, gaps, faces = np.empty((2, 2, 6, 4)), np.empty((2, 2)), np.empty((2, 2), np.int64)
    cosines, shift = np.empty((3, 3)), np.empty((2, 3))
    gaps[1, 0], faces[1, 0], gaps[1, 1], faces[1, 1] = between_boxes(shapes, a, b, x, R, cosines, shift)
    for way in range(2):
        one, other = (a, b) if way == 0 else (b, a)
        count = planes_seen_from(shapes, one, other, x, R, planes[0, way])
        gaps[0, way], faces[0, way] = separation(
            shapes.node, shapes.node_start[one], shapes.vertex_end[one], planes[0, way], count
        )
        planes_of_box(shapes.half[other], cosines, shift[way], way == 1, planes[1, way])
    return planes, gaps, faces


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_half_edges_give_the_bits_of_the_vertices(seed, upright):
    random = np.random.default_rng(seed)
    blocks = [Block(name, np.zeros(3), size=10 ** random.uniform(-1.5, 0.5, 3)) for name in "ab"]
    R = Rotation.random(2, random_state=random).as_matrix()
    if upright:
        R[random.integers(2)] = np.eye(3)
    x = 30.0 * random.normal(size=3) + random.normal(size=(2, 3))
    planes, gaps, faces = both_ways(contact_shapes(blocks, [], 3), 0, 1, x, R)
    assert (gaps[0] == gaps[1]).all()
    assert (faces[0] == faces[1]).all()
    assert (planes[0] == planes[1]).all()


def plain_shapes(*arguments):
    """Bodies without half edges, in reach of one another from much farther away."""
    shapes = contact_shapes(*arguments)
    return shapes._replace(half=np.full_like(shapes.half, np.nan), swell=30.0 * shapes.swell)


def heap(seed):
    """Boxes and stones that fall on one another, turning."""
    random, blocks = np.random.default_rng(seed), []
    for shape, height in (("boxes", 0.0), ("polyhedra", 1.6)):
        blocks += rubble_blocks(shape, (0.0, 0.0, height), (1.6, 1.6, 1.6), 10, (0.4, 0.8), seed, shape)
    return [b.changed(velocity=random.normal(size=3), spin=random.normal(size=3)) for b in blocks]


def fallen(seed, monkeypatch, plain=False, all_nodes=False):
    """State of the heap after 0.9 s, and how many contacts there are. all_nodes: those near faces are listed anew in
    every substep."""
    add_forces = forces.ContactForces.add_forces

    def of_all_nodes(self, dt, F):
        self._pairs.left[:] = 0.0
        add_forces(self, dt, F)

    with monkeypatch.context() as patch:
        if plain:
            patch.setattr(forces, "contact_shapes", plain_shapes)
        if all_nodes:
            patch.setattr(forces.ContactForces, "add_forces", of_all_nodes)
        with Structure(heap(seed), ContactLaw(1e7, 0.3, 0.5), ground=0.0) as s:
            for _ in range(9):
                s.advance(0.1)
            return s.save(), len(s.contacts())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_heap_falls_with_the_same_bits_as_by_vertices_and_wide_margins(seed, monkeypatch):
    """Pairs that are passed by because they are clear of one another have no contact."""
    now, count = fallen(seed, monkeypatch)
    before, _ = fallen(seed, monkeypatch, plain=True)
    assert count > 10
    assert_same(now, before)


def assert_same(now, before):
    assert (now.motion == before.motion).all()
    for name, values in now.contacts.items():
        assert (values == before.contacts[name]).all(), name


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nodes_that_are_passed_by_come_into_no_contact(seed, monkeypatch):
    """Between two lists of the nodes near the faces of another block no other node gets there, however far blocks go
    until their neighbours are sought, when the lists are made anew too."""
    monkeypatch.setattr(scene, "VERLET", 1.0)
    now, count = fallen(seed, monkeypatch)
    assert count > 10
    assert_same(now, fallen(seed, monkeypatch, all_nodes=True)[0])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_swell_bounds_how_far_a_block_grows_as_its_faces_move_outwards(seed):
    """Support of the block with moved faces by a linear program, for random directions and that of a corner."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(int(random.integers(4, 14)), 3))
    block = Block("a", np.zeros(3), vertices=points / np.linalg.norm(points, axis=1)[:, None])
    swell = contact_shapes([block], [], 3).swell[0]
    normals, offsets = block.planes
    out = 0.01 * offsets.min()
    grown = []
    for n in [*Rotation.random(20, random_state=random).as_matrix()[:, 0], *block.vertices]:
        n = n / np.linalg.norm(n)
        far = linprog(-n, A_ub=normals, b_ub=offsets + out, bounds=[(None, None)] * 3)
        grown.append((-far.fun - (block.vertices @ n).max()) / out)
    assert max(grown) <= swell * (1.0 + 1e-6)


def test_swell_of_a_box_is_that_of_its_corner():
    shapes = contact_shapes([Block("a", np.zeros(3), size=(1.0, 2.0, 0.3))], [], 3)
    assert shapes.swell[0] == pytest.approx(np.sqrt(3.0), rel=1e-12)
