"""Convex polyhedra: moments against closed forms and an independent triangulation, plane faces, and refusals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

from yade_scripts.blocks.block import BOX_CORNERS, BOX_FACES, Block, BlockError
from yade_scripts.blocks.polyhedra import convex_polyhedron, face_planes, flattened, polyhedron_moments

seeds = st.integers(0, 10**6)


def hull_of(seed, corners=14):
    """Random corners on a sphere, pulled out of round: all of them are corners of their hull."""
    r = np.random.default_rng(seed)
    x = r.normal(size=(corners, 3))
    return x / np.linalg.norm(x, axis=1)[:, None] * r.uniform(0.2, 3.0, 3)


def moments_by_delaunay(vertices):
    """Volume, centroid and central second moments over Qhull's own tetrahedra: another decomposition, exact as well."""
    x = vertices[Delaunay(vertices).simplices]
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6.0
    V, centre = volume.sum(), volume @ x.mean(axis=1) / volume.sum()
    d = x - centre
    second = np.einsum("t,tia,tib->ab", volume, d, d) + np.einsum("t,tia,tjb->ab", volume, d, d)
    return V, centre, second / 20.0


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_moments_of_any_hull_agree_with_another_decomposition(seed):
    x = hull_of(seed)
    V, centre, second = polyhedron_moments(*convex_polyhedron("h", x))
    expected = moments_by_delaunay(x)
    np.testing.assert_allclose(V, expected[0], rtol=1e-12)
    np.testing.assert_allclose(centre, expected[1], atol=1e-12)
    np.testing.assert_allclose(second, expected[2], atol=1e-12 * np.abs(second).max())


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_a_turned_block_keeps_its_mass_and_turns_its_inertia(seed):
    """I' = Q I Qᵀ for vertices turned by Q; the principal moments are those of the body whatever its axes."""
    x, Q = hull_of(seed), Rotation.random(random_state=seed).as_matrix()
    a, b = Block("a", np.zeros(3), vertices=x), Block("b", np.zeros(3), vertices=x @ Q.T)
    scale = np.abs(a.inertia).max()
    assert b.mass == pytest.approx(a.mass, rel=1e-12)
    np.testing.assert_allclose(b.inertia, Q @ a.inertia @ Q.T, atol=1e-12 * scale)
    np.testing.assert_allclose(np.linalg.eigvalsh(b.inertia), np.linalg.eigvalsh(a.inertia), rtol=1e-10)


@pytest.mark.parametrize("sides", [3, 5, 6, 12, 64])
def test_a_prism_has_the_moments_of_its_polygon(sides):
    """Regular n-gon of circumradius 1, height 2: A = n/2 sin 2π/n, I_polar = A/6 (2 + cos 2π/n) (in the plane)."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    block = Block(
        "p", np.zeros(3), vertices=np.vstack([np.c_[ring, -np.ones(sides)], np.c_[ring, np.ones(sides)]])
    )
    area = 0.5 * sides * np.sin(2 * np.pi / sides)
    polar = area * (2.0 + np.cos(2 * np.pi / sides)) / 6.0
    assert len(block.faces) == sides + 2
    assert block.volume == pytest.approx(2.0 * area, rel=1e-12)
    assert block.inertia[2, 2] == pytest.approx(2.0 * block.density * polar, rel=1e-12)
    transverse = block.density * (
        polar + area * 2.0**3 / 12.0
    )  # half the polar part of length 2, and A h³/12
    assert block.inertia[0, 0] == pytest.approx(transverse, rel=1e-12)


@pytest.mark.parametrize("offset", [0.0, 5e5, 5e6])
def test_map_coordinates_cost_no_more_than_their_own_rounding(offset):
    """Doubles at 5e6 m are 1e-9 m apart: a block of 1 m is right to a few of these, not to percent."""
    shift = np.array([offset, -0.7 * offset, 30.0])
    Q = Rotation.from_rotvec([0.3, 0.5, 0.2]).as_matrix()
    block = Block.standing("far", 0.5 * BOX_CORNERS @ Q.T + shift)
    assert len(block.faces) == 6
    assert block.volume == pytest.approx(1.0, abs=1e-15 * max(offset, 10.0))
    np.testing.assert_allclose(np.linalg.eigvalsh(block.inertia), 400.0, rtol=1e-15 * max(offset, 10.0))
    np.testing.assert_allclose(block.centre, shift, atol=2e-9 if offset else 1e-15)


@settings(max_examples=20, deadline=None)
@given(seeds, st.floats(1e-8, 1e-5))
def test_corners_off_by_single_precision_give_plane_faces(seed, noise):
    """A dodecahedron (12 pentagons) whose corners are off by `noise`: still 12 faces, plane to rounding, none of its
    corners moved by more than a few times the noise."""
    x = dodecahedron() @ Rotation.random(random_state=seed).as_matrix().T
    x = x + noise * np.random.default_rng(seed).uniform(-1, 1, x.shape)
    vertices, faces = convex_polyhedron("d", x, tolerance=10 * noise)
    assert sorted(len(f) for f in faces) == [5] * 12
    normals, offsets = face_planes(vertices, faces)
    bend = max(np.abs(vertices[list(f)] @ n - o).max() for f, n, o in zip(faces, normals, offsets))
    assert bend < 1e-13
    assert np.abs(vertices - x).max() < 4 * noise


def dodecahedron():
    g = (1.0 + np.sqrt(5.0)) / 2.0
    cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    ring = [(a / g, b * g) for a in (-1, 1) for b in (-1, 1)]
    return np.array(
        cube + [(0, p, q) for p, q in ring] + [(p, q, 0) for p, q in ring] + [(q, 0, p) for p, q in ring]
    )


def test_flattening_leaves_plane_faces_alone():
    x, faces = convex_polyhedron("d", dodecahedron())
    np.testing.assert_allclose(flattened(x, faces), x, atol=1e-14)


def test_points_within_faces_and_edges_are_no_corners():
    """A cube with the middles of its faces and edges among its vertices, as tessellations have them."""
    grid = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    block = Block("cube", np.zeros(3), vertices=grid[np.abs(grid).max(axis=1) == 1.0])
    assert len(block.vertices) == 8
    assert sorted(map(len, block.faces)) == [4] * 6


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.vstack([BOX_CORNERS, [[0.2, 0.1, 0.0]]]), None, "vertex 8 lies 0.8 m inside the convex hull"),
        (BOX_CORNERS * [1, 1, 0], None, "span no volume"),
        (BOX_CORNERS * [1, 1, 1e-12], None, "span no volume"),
        (BOX_CORNERS, BOX_FACES[:-1], "is not closed: the edge from"),
        (BOX_CORNERS, (*BOX_FACES[:-1], BOX_FACES[-1][::-1]), "is not closed: the edge from"),
        (BOX_CORNERS, tuple(f[::-1] for f in BOX_FACES), "seen from inside"),
        (BOX_CORNERS + 0.1 * np.eye(8)[:, [0, 1, 6]], BOX_FACES, "is bent"),
        (np.zeros((4, 2)), None, "rows of three finite numbers"),
        (np.full((4, 3), np.nan), None, "rows of three finite numbers"),
    ],
)  # fmt: skip
def test_what_is_no_convex_block_is_refused(vertices, faces, says):
    with pytest.raises(BlockError, match="block 'b'") as refusal:
        convex_polyhedron("b", vertices, faces)
    assert says in str(refusal.value)


def test_the_place_of_a_dent_is_reported_in_the_coordinates_of_the_world():
    dented = BOX_CORNERS.copy()
    dented[6] = 0.1
    place = np.array([10.0, 20.0, 30.0])
    with pytest.raises(BlockError, match=r"not convex .* at \(10.775, 19.775, 29.775\) m"):
        convex_polyhedron("b", dented + place, BOX_FACES)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_planes_of_a_block_hold_its_corners_and_nothing_else(seed):
    """Points are inside the planes exactly where Qhull's triangulation finds them inside."""
    x = hull_of(seed)
    block = Block.standing("h", x, rotation=np.eye(3))
    normals, offsets = block.planes
    points = np.random.default_rng(seed).uniform(-3, 3, (200, 3))
    inside = ((points - block.centre) @ normals.T <= offsets).all(axis=1)
    np.testing.assert_array_equal(inside, Delaunay(x[ConvexHull(x).vertices]).find_simplex(points) >= 0)


def test_a_changed_block_is_the_same_body():
    for block in (Block("a", (1, 2, 3), size=(1, 2, 3)), Block.standing("a", hull_of(3))):
        moved = block.changed(fixed=True, centre=block.centre + 1.0)
        assert (moved.fixed, moved.name) == (True, "a")
        np.testing.assert_allclose(moved.world_vertices(), block.world_vertices() + 1.0, atol=1e-14)
