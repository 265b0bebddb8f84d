"""Rotations, and overlaps of convex bodies."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from coupler.geometry.bodies import Body, overlap_depth, rotation_matrix
from yade_scripts.blocks.block import Block

SPACE = st.floats(-3.0, 3.0)
EDGE = st.floats(0.1, 2.0)


def turns(draw):
    axis = draw(st.tuples(SPACE, SPACE, SPACE).filter(lambda a: np.linalg.norm(a) > 0.1))
    return rotation_matrix(axis, draw(st.floats(-3.2, 3.2)))


@st.composite
def boxes(draw):
    """Centre, size, rotation."""
    return (
        np.array(draw(st.tuples(SPACE, SPACE, SPACE))),
        np.array(draw(st.tuples(EDGE, EDGE, EDGE))),
        turns(draw),
    )


@st.composite
def stones(draw):
    """A box, or a random hull of ten corners."""
    if draw(st.booleans()):
        return Body.box(*draw(boxes()))
    random = np.random.default_rng(draw(st.integers(0, 10**6)))
    x = random.normal(size=(10, 3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    return Body.of_block(Block.standing("h", x + random.uniform(-2, 2, 3)))


@given(boxes())
def test_a_rotation_keeps_lengths_and_handedness(box):
    rotation = box[2]
    assert np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(rotation), 1.0, rtol=1e-12)


@settings(deadline=None)
@given(stones(), stones())
def test_overlap_is_symmetric_and_agrees_with_points_and_planes(a, b):
    """A point in both bodies proves an overlap; corners on far sides of a plane prove that there is none; the depth is
    the same seen from either."""
    depth = overlap_depth(a, b)
    assert np.isclose(depth, overlap_depth(b, a), atol=1e-9)
    share = np.random.default_rng(0).dirichlet(np.full(len(a.vertices), 0.3), 100)
    inside_a = share @ a.vertices
    if (b.depth(inside_a) > 0.0).any():
        assert depth > 0.0
    heights = linprog_gap(a.vertices, b.vertices)
    assert (depth <= 1e-9) == heights if abs(depth) > 1e-6 else True


def linprog_gap(a, b):
    """Whether a plane n·x = c has a on one side and b on the other: a linear program, not an axis test."""
    rows = np.vstack([np.c_[a, -np.ones(len(a))], np.c_[-b, np.ones(len(b))]])
    found = linprog(np.zeros(4), A_ub=rows, b_ub=-np.ones(len(rows)), bounds=[(None, None)] * 4)
    return found.status == 0


@settings(deadline=None)
@given(stones(), SPACE, SPACE, SPACE)
def test_moving_apart_by_more_than_the_depth_can_part_two_bodies(a, x, y, z):
    """The depth is a length by which some move parts them: never more than a body's own thickness plus the other's."""
    b = Body(a.vertices + np.array([x, y, z]), a.normals, a.edges)
    assert overlap_depth(a, b) <= 2 * a.thickness() + 1e-9
    far = Body(a.vertices + a.normals[0] * 1.0001 * np.ptp(a.vertices @ a.normals[0]), a.normals, a.edges)
    assert overlap_depth(a, far) < 0.0


def test_the_depth_of_boxes_is_that_of_the_face_they_share():
    a = Body.box((0, 0, 0), (1, 1, 1), rotation_matrix((1, 2, 3), 0.7))
    b = Body.box(rotation_matrix((1, 2, 3), 0.7) @ [0.7, 0, 0], (1, 1, 1), rotation_matrix((1, 2, 3), 0.7))
    assert np.isclose(overlap_depth(a, b), 0.3, rtol=1e-12)
