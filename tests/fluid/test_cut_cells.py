"""Single cells and meshes of general tetrahedra cut by unions of convex bodies, against the solid modeller."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import Connection
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import Background, box_mesh
from fluid.mesh.gradients import gradients
from tests.fluid import solid_modeller
from tests.fluid.test_cut import divergence_defect

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def cell(rng):
    """Corners (4, 3) of a tetrahedron that is not flat."""
    while True:
        x = rng.uniform(0, 1, (4, 3))
        if abs(np.linalg.det(x[1:] - x[0])) > 0.18:
            return x


def anywhere(rng, x):
    """A turned box or the hull of 4 to 13 points, of any size down to a fiftieth of the cell."""
    if rng.random() < 0.5:
        turn = Rotation.random(rng=rng).as_matrix()
        return ((CUBE - 0.5) * rng.uniform(0.02, 0.8, 3)) @ turn.T + rng.uniform(0, 1, 3)
    return rng.uniform(0, 1, 3) + 0.3 * rng.normal(size=(rng.integers(4, 14), 3))


def special_point(rng, x):
    """A node, a point of an edge or of the plane of a face, in or beyond the cell, its centre, or any point."""
    kind = rng.integers(0, 6)
    if kind == 0:
        return x[rng.integers(4)]
    a, b, c, _ = rng.permutation(4)
    t = rng.choice([0.5, 0.25, 1.0, 2.0, -1.0, rng.random()])
    if kind == 1:
        return x[a] + t * (x[b] - x[a])
    if kind == 2:
        return x[a] + t * (x[b] - x[a]) + rng.choice([0.5, 0.25, rng.random()]) * (x[c] - x[a])
    if kind == 3:
        return x.mean(axis=0)
    return x[a] + rng.normal(size=3) if kind == 4 else rng.uniform(-0.5, 1.5, 3)


def in_special_place(rng, x):
    """A hull of special points, most often tilted by 1e-17 to 1e-6 and shifted as little."""
    while True:
        p = np.array([special_point(rng, x) for _ in range(rng.integers(4, 9))])
        p = np.unique(p.round(15), axis=0)
        thickness = np.linalg.svd(p - p.mean(axis=0), compute_uv=False)
        if len(p) >= 4 and thickness[-1] > 0.05 * thickness[0]:
            break
    exponent = rng.integers(-17, -5)
    if rng.random() < 0.3:
        return p
    turn = Rotation.from_rotvec(10.0**exponent * rng.normal(size=3)).as_matrix()
    tilted = (p - p.mean(axis=0)) @ turn.T + p.mean(axis=0)
    return tilted + 10.0 ** rng.integers(-17, -5) * rng.normal(size=3) * (rng.random() < 0.5)


def cut_cell(seed, family):
    """(cell, its domain, solids of the modeller) with 1 to 6 bodies."""
    rng = np.random.default_rng(seed)
    x = cell(rng)
    hulls = [family(rng, x) for _ in range(rng.integers(1, 7))]
    bodies = ConvexBodies.from_polyhedra([(p, None) for p in hulls])
    mesh = Background.from_arrays(x, [[0, 1, 2, 3]])
    domain = cut_domain(mesh, bodies, "multiple", connection=Connection(pocket=0.0))
    return x, domain, [solid_modeller.hull(p) for p in hulls]


def second_moment(domain):
    """∫ x xᵀ dV (3, 3) of all cells."""
    s = domain.second_of(np.arange(len(domain.cells))).sum(axis=0)
    total = np.array([[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]])
    return total + np.einsum("m,mi,mj->ij", domain.volume, domain.centroid, domain.centroid)


def check_cell(seed):
    """Moments to degree 2 and the surface of every owner; inside and outside make the cell to 1e-13."""
    x, domain, solids = cut_cell(seed, anywhere)
    whole, union = solid_modeller.hull(x), solid_modeller.union(solids)
    water = whole - union
    assert domain.volume.sum() + (whole ^ union).volume() == pytest.approx(whole.volume(), abs=1e-13)
    volume, first, second = solid_modeller.moments(water)
    assert domain.volume.sum() == pytest.approx(volume, abs=1e-14)
    np.testing.assert_allclose(domain.volume @ domain.centroid, first, atol=1e-14)
    np.testing.assert_allclose(second_moment(domain), second, atol=1e-14)
    corners, owner = solid_modeller.triangles(water)
    reference = solid_modeller.vector_area(corners)
    for b, solid in enumerate(solids):
        ours, theirs = domain.face_body == b, owner == solid.original_id()
        assert domain.face_area[ours].sum() == pytest.approx(
            np.linalg.norm(reference[theirs], axis=1).sum(), abs=1e-13
        )
        vector = domain.face_area[ours] @ domain.face_normal[ours]
        np.testing.assert_allclose(vector, -reference[theirs].sum(axis=0), atol=1e-13)


def check_special_cell(seed):
    """Never a failure, and no more volume off than the snapping of nodes to planes moves (1e-10 of the size)."""
    x, domain, solids = cut_cell(seed, in_special_place)
    whole = solid_modeller.hull(x)
    inside = whole ^ solid_modeller.union(solids)
    assert domain.volume.sum() + inside.volume() == pytest.approx(whole.volume(), abs=2e-10)


def test_cells_cut_by_bodies_anywhere():
    for seed in range(150):
        check_cell(seed)


def test_cells_cut_by_bodies_in_special_places():
    """Faces, edges and corners of bodies on those of the cell, exactly and up to noise of every size."""
    for seed in range(150):
        check_special_cell(seed)


@pytest.mark.parametrize("seed", [665, 879, 1434, 2577, 2902, 3272, 3431, 4880])
def test_planes_through_a_common_point(seed):
    """A plane through a corner where three others meet up to round-off: a face without extent lies in it."""
    check_special_cell(seed)


@pytest.mark.nightly
@pytest.mark.parametrize("block", range(8))
def test_many_cells(block):
    for seed in range(1000 + 2500 * block, 1000 + 2500 * (block + 1)):
        check_cell(seed)
        check_special_cell(seed)


def general_mesh(n, seed=0):
    """The unit cube in tetrahedra of no particular shape."""
    box = box_mesh((0, 0, 0), (1, 1, 1), 1 / n)
    inner = ((box.nodes > 1e-9) & (box.nodes < 1 - 1e-9)).all(axis=1)
    move = np.random.default_rng(seed).uniform(-0.2, 0.2, box.nodes.shape) / n
    return Background.from_arrays(box.nodes + inner[:, None] * move, box.cells)


GENERAL = general_mesh(4)


def on_nodes(seed, n):
    """Hulls of 5 to 7 nodes of the mesh: corners on nodes, edges on edges, faces that share planes with cells."""
    rng = np.random.default_rng(seed)
    hulls = []
    while len(hulls) < n:
        middle = GENERAL.nodes[rng.integers(len(GENERAL.nodes))]
        order = np.argsort(np.linalg.norm(GENERAL.nodes - middle, axis=1))
        p = GENERAL.nodes[rng.choice(order[:20], rng.integers(5, 8), replace=False)]
        thickness = np.linalg.svd(p - p.mean(axis=0), compute_uv=False)
        if thickness[-1] > 0.1 * thickness[0]:
            hulls.append(p)
    return hulls


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(1, 6),
    tilt=st.integers(-16, -6),
    growth=st.integers(-15, -4),
    grown=st.booleans(),
)
def test_hulls_of_mesh_nodes(seed, n, tilt, growth, grown):
    """Volume of the water to the snapping, and the divergence theorem at every inner node, for bodies on the nodes
    of the mesh that are tilted by 1e-16 to 1e-6 and grown by 1e-15 to 1e-4 of their size."""
    rng = np.random.default_rng(seed)
    hulls = on_nodes(seed, n)
    turn = Rotation.from_rotvec(10.0**tilt * rng.normal(size=(n, 3))).as_matrix()
    hulls = [(p - p.mean(axis=0)) @ r.T + p.mean(axis=0) for p, r in zip(hulls, turn)]
    bodies = ConvexBodies.from_polyhedra([(p, None) for p in hulls])
    solids = [solid_modeller.hull(p) for p in hulls]
    domain = cut_domain(GENERAL, bodies)
    room = solid_modeller.hull(CUBE)
    water = room - solid_modeller.union(solids)
    assert domain.volume.sum() == pytest.approx(water.volume(), abs=1e-10)
    assert divergence_defect(domain) < 1e-10
    if grown:
        larger = cut_domain(GENERAL, bodies.grown(10.0**growth))
        surface = sum(solid.surface_area() for solid in solids)
        assert -2e-10 < domain.volume.sum() - larger.volume.sum() < 2e-10 + 4 * 10.0**growth * surface
        assert divergence_defect(larger) < 1e-10


def test_closed_bodies_have_no_resultant_area():
    """Σ n A = 0 and Σ x·n A / 3 = volume for each body that no other one touches, wherever it lies in the cells."""
    centres = 0.25 + 0.5 * CUBE
    for seed in range(20):
        rng = np.random.default_rng(seed)
        hulls = [c + 0.24 * rng.uniform(-1, 1, (rng.integers(5, 15), 3)) for c in centres]
        domain = cut_domain(GENERAL, ConvexBodies.from_polyhedra([(p, None) for p in hulls]))
        for b, points in enumerate(hulls):
            own = domain.face_body == b
            area, normal = domain.face_area[own], domain.face_normal[own]
            np.testing.assert_allclose(area @ normal, 0, atol=1e-13 * area.sum())
            arm = domain.face_centroid[own] - centres[b]
            volume = (area * (arm * normal).sum(axis=1)).sum() / 3
            assert volume == pytest.approx(solid_modeller.hull(points).volume(), rel=1e-12)


def test_every_polygon_lies_on_its_owner_between_solid_and_water():
    """Corners in a plane of the owner with that normal; one step inward lies in the owner, one outward in no body,
    and the polygon belongs to the cell it lies in."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        hulls = [anywhere(rng, None) for _ in range(6)]
        bodies = ConvexBodies.from_polyhedra([(p, None) for p in hulls])
        domain = cut_domain(GENERAL, bodies)
        for b in range(6):
            own = domain.face_body == b
            planes = slice(bodies.plane_start[b], bodies.plane_start[b + 1])
            normals, offsets = bodies.normals[planes], bodies.offsets[planes]
            plane = np.argmax(domain.face_normal[own] @ normals.T, axis=1)
            np.testing.assert_array_equal(domain.face_normal[own], normals[plane])
            height = np.einsum("ski,si->sk", domain.face_corners[own], normals[plane]) - offsets[plane, None]
            np.testing.assert_allclose(height, 0, atol=1e-9)
        width = np.sqrt(domain.face_area)
        fat = width > 1e-3
        step = 1e-7 * domain.face_normal[fat]
        assert (bodies.contains(domain.face_centroid[fat] + step) == -1).all()
        inside = bodies.contains(domain.face_centroid[fat] - step)
        assert (inside >= 0).all()
        g, _ = gradients(domain.nodes, domain.cells[domain.face_cell])
        first = domain.nodes[domain.cells[domain.face_cell, 0]]
        weight = np.einsum("sak,sqk->sqa", g, domain.face_corners - first[:, None])
        weight[:, :, 0] += 1
        assert weight.min() > -1e-9
