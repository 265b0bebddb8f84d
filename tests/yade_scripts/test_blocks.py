"""Mass properties of blocks, touching faces and generators: exact figures, and refusals that name the block."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from yade_scripts.blocks.block import BOX_CORNERS, Block, BlockError
from yade_scripts.blocks.faces import FixedPlane, gauss_points, touching_faces
from yade_scripts.blocks.generators.building import Building, Opening, building_blocks

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
    from yade_scripts.blocks.block import BOX_FACES

    with pytest.raises(BlockError, match="not convex"):
        Block("dented", np.zeros(3), vertices=corners, faces=BOX_FACES)


@settings(max_examples=30, deadline=None)
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


@pytest.mark.parametrize(("taper", "points"), [(0.0, 9), (1e-3, 36)])
def test_the_rule_of_a_face_does_not_depend_on_where_it_lies(taper, points):
    """A face of 2 m that narrows by 2 mm is no parallelogram, at the origin and a kilometre away."""
    face = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0 - taper, 0.0, 1.0], [taper, 0.0, 1.0]])
    for place in (np.zeros(3), np.array([900.0, -700.0, 30.0])):
        assert len(gauss_points(face + place, 3)[1]) == points


def test_building_has_the_volume_of_its_walls_slabs_and_openings():
    """Walls as the difference of two prisms, three slabs, minus one door of whole blocks."""
    solid = Building((0, 0), (20, 10), 12.0, 0.5, 1.9, storeys=3)
    blocks = building_blocks(solid)
    walls = (20 * 10 - 19 * 9) * (12.0 - 3 * 0.5)
    assert sum(b.volume for b in blocks) == pytest.approx(walls + 3 * 0.5 * 200.0, rel=1e-12)
    assert min(b.centre[2] - b.size[2] / 2 for b in blocks) == pytest.approx(0.0, abs=1e-12)
    assert max(b.centre[2] + b.size[2] / 2 for b in blocks) == pytest.approx(12.0)
    thin = building_blocks(replace(solid, floor_thickness=0.2))
    assert sum(b.volume for b in thin) == pytest.approx(
        (20 * 10 - 19 * 9) * (12.0 - 3 * 0.2) + 3 * 0.2 * 200.0
    )


def joined_to_ground(blocks):
    """Number of pieces that the joints leave of the blocks together with the ground."""
    faces = touching_faces(blocks, [GROUND])
    a, b = np.array([f.a for f in faces]), np.array([f.b if f.b >= 0 else len(blocks) for f in faces])
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(blocks) + 1,) * 2)
    return connected_components(graph, directed=False)[0]


OFF_GRID = Opening((8.3, 0, 0.0), (9.41, 0.5, 2.13))
ON_BLOCK_CENTRES = Opening((0, 4.0, 1.0), (0.5, 6.0, 2.2))
NEAR_THE_CORNER = Opening((19.5, 0.6, 5.0), (20.0, 2.0, 6.5))
THROUGH_A_SLAB = Opening((4.0, 9.5, 3.0), (5.0, 10.0, 4.7))
NICHE = Opening((12.0, 0.0, 9.0), (13.0, 0.2, 10.0))


@pytest.mark.parametrize(
    "openings",
    [(OFF_GRID,), (ON_BLOCK_CENTRES,), (OFF_GRID, ON_BLOCK_CENTRES, NEAR_THE_CORNER, THROUGH_A_SLAB, NICHE)],
)
def test_openings_have_exactly_the_size_asked_for_and_all_else_holds_together(openings):
    """Wherever its borders lie on the grid: the volume of the box is missing, no block reaches into it, and joints
    connect every block with the ground."""
    solid = Building((0, 0), (20, 10), 12.0, 0.5, 1.9, storeys=3)
    blocks = building_blocks(replace(solid, openings=openings))
    removed = sum(np.prod(np.subtract(o.upper, o.lower)) for o in openings)
    volume = sum(b.volume for b in building_blocks(solid))
    assert sum(b.volume for b in blocks) == pytest.approx(volume - removed, rel=1e-12)
    for b in blocks:
        low, high = b.centre - 0.5 * b.size + 1e-9, b.centre + 0.5 * b.size - 1e-9
        assert not any(o.meets(low, high) for o in openings)
    assert joined_to_ground(blocks) == 1
    assert min(b.size.min() for b in blocks) > 0.09


def test_an_opening_beside_the_building_is_refused():
    with pytest.raises(BlockError, match="meets no wall"):
        building_blocks(Building((0, 0), (20, 10), 12.0, 0.5, 1.9, openings=(Opening((3, 3, 1), (5, 5, 3)),)))


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 15.0), st.floats(0.3, 4.0), st.floats(0.0, 2.5), st.floats(0.3, 3.0))
def test_any_window_in_a_wall_is_exact(start, width, sill, height):
    """A window anywhere in a wall of 20 m x 6 m; cuts within a millionth of a block count as one."""
    window = Opening((start, 0.0, sill), (start + width, 0.4, sill + height))
    solid = Building((0, 0), (20, 10), 6.0, 0.4, 1.5)
    blocks = building_blocks(replace(solid, openings=(window,)))
    volume = sum(b.volume for b in building_blocks(solid)) - width * height * 0.4
    assert sum(b.volume for b in blocks) == pytest.approx(volume, rel=1e-7)


def test_every_block_of_a_building_is_held():
    """Each block shares a face with another or the ground: no loose corners."""
    blocks = building_blocks(Building((0, 0), (8, 6), 6.0, 0.4, 1.5, storeys=2))
    faces = touching_faces(blocks, [GROUND])
    held = {f.a for f in faces} | {f.b for f in faces}
    assert held >= set(range(len(blocks)))
    assert all(f.area > 1e-3 for f in faces)


def test_a_block_beside_a_tank_wall_is_glued_to_the_ground_alone():
    """A wall that fits the tank must not hang on its sides: those only support."""
    side = FixedPlane((-0.5, 0.0, 0.0), (1.0, 0.0, 0.0), "tank x-", bonds=False)
    found = touching_faces([Block("a", np.array([0.0, 0.0, 0.5]), size=np.ones(3))], [GROUND, side])
    assert [f.b for f in found] == [-1]
