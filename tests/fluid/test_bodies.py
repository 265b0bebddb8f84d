"""Convex bodies: planes, placing, growth and the boxes of the broad search."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import BodyShapes, ConvexBodies, NotConvex, centre_of_volume

WEDGE = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0], [0, 0, 1], [2, 0, 1.0]])
WEDGE_FACES = [[0, 1, 3, 2], [0, 1, 5, 4], [2, 3, 5, 4], [0, 2, 4], [1, 3, 5]]


def test_faces_and_hull_give_the_same_planes():
    listed = ConvexBodies.from_polyhedra([(WEDGE, WEDGE_FACES)])
    hull = ConvexBodies.from_polyhedra([(WEDGE, None)])
    planes = [np.column_stack([b.normals, b.offsets]).round(12) + 0.0 for b in (listed, hull)]
    np.testing.assert_allclose(*(p[np.lexsort(p.T)] for p in planes), atol=1e-12)
    np.testing.assert_allclose(listed.centre[0], [1, 1 / 3, 1 / 3], rtol=1e-13)


def test_a_dented_polyhedron_is_refused():
    dented = np.vstack([WEDGE, [[1, 0.2, 0.9]]])
    with pytest.raises(NotConvex, match=r"polyhedron 0.*split it into convex parts"):
        ConvexBodies.from_polyhedra([(dented, WEDGE_FACES)])


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_placing_is_a_rigid_motion(seed):
    """A point of the body frame is inside before exactly if it is inside after."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(12, 3))
    centre = centre_of_volume(corners)
    shapes = BodyShapes.from_polyhedra([(corners - centre, None)])
    rotation = Rotation.random(1, rng=seed).as_matrix()
    shift = rng.normal(size=(1, 3)) * 10
    placed = shapes.placed(shift, rotation)
    points = rng.normal(size=(50, 3))
    here = shapes.placed(np.zeros((1, 3))).contains(points)
    np.testing.assert_array_equal(placed.contains(points @ rotation[0].T + shift), here)
    np.testing.assert_allclose(centre_of_volume(placed.vertices), shift[0], atol=1e-12)


def test_moving_does_not_depend_on_the_batch():
    """The planes of a body are the same bit for bit whatever else moves: cutting again relies on it."""
    rng = np.random.default_rng(0)
    size, centre = rng.uniform(0.1, 1, (7, 3)), rng.normal(size=(7, 3))
    rotation = Rotation.random(7, rng=1).as_matrix()
    together = ConvexBodies.boxes(centre, size, rotation)
    for b in range(7):
        alone = ConvexBodies.boxes(centre[b : b + 1], size[b : b + 1], rotation[b : b + 1])
        np.testing.assert_array_equal(together.normals[6 * b : 6 * b + 6], alone.normals)
        np.testing.assert_array_equal(together.offsets[6 * b : 6 * b + 6], alone.offsets)


def test_bounds_hold_the_grown_body():
    """The corners of the grown wedge (its planes shifted by 0.1 m) lie in the bounds."""
    bodies = ConvexBodies.from_polyhedra([(WEDGE, WEDGE_FACES)]).grown(0.1)
    low, high = bodies.bounds()[0]
    points = np.random.default_rng(0).uniform(-1, 3, (200_000, 3))
    inside = points[bodies.contains(points) == 0]
    assert (inside >= low).all()
    assert (inside <= high).all()
    assert inside[:, 0].max() > 2.09


def test_no_bodies():
    empty = ConvexBodies.empty()
    assert len(empty) == 0
    assert empty.bounds().shape == (0, 2, 3)
    np.testing.assert_array_equal(empty.contains([[0, 0, 0]]), [-1])
