"""Mass properties of blocks, touching faces and generators: exact figures, and refusals that name the block."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from yade_scripts.blocks import BOX_CORNERS, Block, BlockError
from yade_scripts.building import Building, Opening, building_blocks, column_blocks, wall_blocks
from yade_scripts.faces import FixedPlane, gauss_points, touching_faces

GROUND = FixedPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
edges = st.tuples(*[st.floats(0.01, 50.0)] * 3)


@given(edges, st.tuples(*[st.floats(-1e3, 1e3)] * 3))
def test_a_box_given_by_its_corners_has_the_mass_and_inertia_of_the_box(size, shift):
    """Two ways to the same body, the second through tetrahedra: m/12 (b² + c²), anywhere in space."""
    box = Block("box", np.zeros(3), size=size)
    hull = Block("hull", np.zeros(3), vertices=0.5 * np.array(size) * BOX_CORNERS + np.array(shift))
    assert hull.volume == pytest.approx(box.volume, rel=1e-7)
    np.testing.assert_allclose(hull.inertia, box.inertia, rtol=0, atol=1e-6 * box.inertia.max())
    assert len(hull.faces) == 6


def test_regular_tetrahedron():
    """I = m a²/20 about every axis through the centre, V = a³/(6 sqrt 2)."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    block = Block("tet", np.zeros(3), vertices=corners, density=1.0)
    a = np.sqrt(8.0)
    assert block.volume == pytest.approx(a**3 / (6 * np.sqrt(2)), rel=1e-12)
    np.testing.assert_allclose(block.inertia, np.eye(3) * block.mass * a**2 / 20, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"size": (1, -1, 1)}, "size"),
        ({"size": 1.0, "density": 0.0}, "density"),
        ({"size": 1.0, "rotation": 2 * np.eye(3)}, "rotation"),
        ({"size": 1.0, "centre": (np.nan, 0, 0)}, "centre"),
        ({}, "either size"),
        ({"vertices": np.eye(3)}, "no volume"),
    ],
)
def test_impossible_blocks_are_refused_by_name(wrong, word):
    with pytest.raises(BlockError, match=word):
        Block(**({"name": "b7", "centre": np.zeros(3)} | wrong))


def test_a_dented_block_is_refused_with_the_face():
    """A cube with one corner pushed in is not convex."""
    corners = BOX_CORNERS.copy()
    corners[6] = 0.1
    from yade_scripts.blocks import BOX_FACES

    with pytest.raises(BlockError, match="not convex"):
        Block("dented", np.zeros(3), vertices=corners, faces=BOX_FACES)


@settings(max_examples=30)
@given(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.integers(0, 1000))
def test_overlap_of_two_faces_is_exact_wherever_they_stand(dx, dy, seed):
    """Unit cubes shifted by (dx, dy) on one another overlap on (1-|dx|)(1-|dy|), in any orientation."""
    R = Rotation.random(random_state=seed).as_matrix()
    low = Block("low", np.zeros(3), size=1.0, rotation=R)
    high = Block("high", R @ np.array([dx, dy, 1.0]), size=1.0, rotation=R)
    (face,) = touching_faces([low, high])
    assert face.area == pytest.approx((1 - abs(dx)) * (1 - abs(dy)), rel=1e-9)
    np.testing.assert_allclose(face.normal, R[:, 2], atol=1e-12)


def test_edges_and_gaps_are_no_joints():
    """Faces that meet in a line, or are 1 mm apart, do not touch."""
    a = Block("a", np.zeros(3), size=1.0)
    assert not touching_faces([a, Block("b", (1.0, 0.0, 1.0), size=1.0)])
    assert not touching_faces([a, Block("b", (1.001, 0.0, 0.0), size=1.0)])


def test_gauss_rule_on_any_convex_polygon_integrates_quadratics():
    """Hexagon of radius 1: area 3√3/2, ∫ x² = 5√3/16."""
    angle = np.arange(6) * np.pi / 3
    hexagon = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    x, w = gauss_points(hexagon, 3)
    assert w.sum() == pytest.approx(1.5 * np.sqrt(3), rel=1e-12)
    assert w @ x[:, 0] ** 2 == pytest.approx(5 * np.sqrt(3) / 16, rel=1e-12)


def test_building_has_the_volume_of_its_walls_slabs_and_openings():
    """Walls as the difference of two prisms, three slabs, minus one door of whole blocks."""
    solid = Building((0, 0), (20, 10), 12.0, 0.5, 1.9, storeys=3)
    blocks = building_blocks(solid)
    walls = (20 * 10 - 19 * 9) * (12.0 - 3 * 0.5)
    assert sum(b.volume for b in blocks) == pytest.approx(walls + 3 * 0.5 * 200.0, rel=1e-12)
    assert min(b.centre[2] - b.size[2] / 2 for b in blocks) == pytest.approx(0.0, abs=1e-12)
    assert max(b.centre[2] + b.size[2] / 2 for b in blocks) == pytest.approx(12.0)
    with_door = building_blocks(
        Building((0, 0), (20, 10), 12.0, 0.5, 1.9, storeys=3, openings=(Opening((8, -1, 0), (12, 1, 3)),))
    )
    assert len(with_door) < len(blocks)


def test_every_block_of_a_building_is_held():
    """Each block shares a face with another or the ground: no loose corners."""
    blocks = building_blocks(Building((0, 0), (8, 6), 6.0, 0.4, 1.5, storeys=2))
    faces = touching_faces(blocks, [GROUND])
    held = {f.a for f in faces} | {f.b for f in faces}
    assert held >= set(range(len(blocks)))
    assert all(f.area > 1e-3 for f in faces)


def test_running_bond_joins_each_block_to_two_below():
    blocks = wall_blocks("w", (0, 0, 0), "x", 10.0, 2.0, 0.3, 1.0, 0.5, bond="running")
    faces = touching_faces(blocks)
    bed = [f for f in faces if abs(f.normal[2]) > 0.5]
    assert sum(f.area for f in bed) == pytest.approx(3 * 10.0 * 0.3, rel=1e-12)
    assert {round(f.area, 6) for f in bed} == {0.15}


def test_column_stands_on_its_foot():
    blocks = column_blocks("c", (1, 2, 3), (0.5, 0.5, 1.0), 4)
    assert [b.centre[2] for b in blocks] == [3.5, 4.5, 5.5, 6.5]
