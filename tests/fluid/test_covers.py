"""Multiple covers: thin walls hold water exactly, openings connect, fields stay on their side."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from fluid.bodies import ConvexBodies
from fluid.covers import Connection, components
from fluid.domain import carry, cut_domain, gradients, wetted_coupling
from fluid.mesh import Background, box_mesh

N = 8
H = 1 / N
RHO_G = 9810.0
LEVEL = np.array([1.0, 0.5])
SHARP = Connection(inner=0.1, face=0.2)


def jittered():
    """A cube of general tetrahedra; nodes of the boundary and of the lower water level stay in plane."""
    box = box_mesh((0, 0, 0), (1, 1, 1), H)
    x = box.nodes.copy()
    move = np.random.default_rng(0).uniform(-0.15, 0.15, x.shape) * H
    move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
    move[np.abs(x[:, 2] - LEVEL[1]) < 1e-9, 2] = 0
    return Background.from_arrays(x + move, box.cells)


MESH = jittered()
BOX = box_mesh((0, 0, 0), (1, 1, 1), H)


def hydrostatic_pressure(domain, side):
    """Solve ∫ grad p . grad q = ∫ rho g . grad q with p = 0 on the water level of each side of a wall.

    side (M,) 0 or 1 of each cell -> p (N,), exact p (N,)."""
    wet = domain.nodes[domain.cells][:, :, 2].max(axis=1) <= LEVEL[side] + 1e-9
    g, _ = gradients(domain.nodes, domain.cells)
    n, cells = len(domain.nodes), domain.cells[wet]
    stiffness = np.einsum("e,eac,ebc->eab", domain.volume, g, g)[wet]
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    A = sp.coo_matrix((stiffness.ravel(), (rows, columns)), shape=(n, n)).tocsr()
    b = np.zeros(n)
    np.add.at(b, cells.ravel(), (-RHO_G * domain.volume[:, None] * g[:, :, 2])[wet].ravel())
    level = np.zeros(n)
    level[domain.cells] = LEVEL[side][:, None]
    free = np.zeros(n, dtype=bool)
    free[cells] = True
    free &= np.abs(domain.nodes[:, 2] - level) > 1e-9
    p = np.zeros(n)
    p[free] = spsolve(A[free][:, free].tocsc(), b[free])
    return p, np.where(free, RHO_G * (level - domain.nodes[:, 2]), 0.0)


def wall_force(domain, normal, point):
    """Total force (3,) on all bodies of a wall with water at two levels, and the largest pressure error."""
    side = ((domain.centroid - point) @ normal > 0).astype(int)
    p, exact = hydrostatic_pressure(domain, side)
    load = -(wetted_coupling(domain).T @ p).reshape(-1, 6)
    return load[:, :3].sum(axis=0), np.abs(p - exact).max()


def bricks(count, thickness, gap, angle, seed=0):
    """A wall of count x count blocks across the cube at x = 0.52, gaps [m] between them, turned a little."""
    edge = 1 / count
    at = (np.arange(count) + 0.5) * edge
    centre = np.array([[0.52, y, z] for y in at for z in at])
    size = np.tile([thickness, edge - gap, edge - gap], (len(centre), 1))
    turn = Rotation.from_rotvec(angle * np.random.default_rng(seed).normal(size=centre.shape)).as_matrix()
    return ConvexBodies.boxes(centre, size, turn)


def side_growth(bodies, amount):
    """Shift the faces between blocks outward, not those towards the water."""
    growth = np.full(len(bodies.offsets), amount)
    growth[0::6] = growth[3::6] = 0.0
    return bodies.grown(growth)


@pytest.mark.parametrize("thickness", [0.1, 0.5, 0.9, 1.5])
@pytest.mark.parametrize(("tilt", "yaw"), [(0, 0), (10, 7), (20, -15)])
def test_thin_wall_between_two_levels(thickness, tilt, yaw):
    """Water 1 m and 0.5 m deep: F = rho g (h1^2 - h2^2) / 2 b whatever the thickness and tilt, with the
    exact pressure on both sides. (One field for both sides carries 1 to 36 % of it.)"""
    turn = Rotation.from_euler("yz", [tilt, yaw], degrees=True).as_matrix()
    point = np.array([0.52, 0.5, 0.5])
    domain = cut_domain(MESH, ConvexBodies.boxes([point], [[thickness * H, 4, 4]], turn[None]), "multiple")
    assert components(domain.cells, len(domain.nodes)).max() == 1
    force, error = wall_force(domain, turn[:, 0], point)
    assert force[0] == pytest.approx(RHO_G * 0.375, rel=1e-12)
    assert error < 1e-9 * RHO_G


def test_single_cover_leaks_through_a_thin_wall():
    """The reason for the multiple covers: half a cell thick, the wall carries almost nothing."""
    point = np.array([0.52, 0.5, 0.5])
    domain = cut_domain(MESH, ConvexBodies.boxes([point], [[0.5 * H, 4, 4]]))
    force, _ = wall_force(domain, np.array([1.0, 0, 0]), point)
    assert abs(force[0]) < 0.5 * RHO_G * 0.375


@pytest.mark.parametrize(("gap", "angle"), [(0, 0), (1e-9, 0), (1e-6, 0), (5e-3, 0), (0, 1e-5), (0, 1e-3)])
def test_joints_closed_by_growth_carry_the_full_load(gap, angle):
    """A wall of 5 x 5 bonded blocks with noisy gaps or turns: exact force once the joints are closed."""
    bodies = side_growth(bricks(5, 0.5 * H, gap, angle), gap / 2 + 0.6 * angle + 1e-7)
    domain = cut_domain(MESH, bodies, "multiple")
    force, error = wall_force(domain, np.array([1.0, 0, 0]), np.array([0.52, 0.5, 0.5]))
    # Turned faces look a little upward: the horizontal load is exact to the turn only.
    assert force[0] == pytest.approx(RHO_G * 0.375, rel=1e-10 + 2 * angle)
    assert error < 1e-6 * RHO_G


def test_blocks_that_meet_along_an_edge_separate_the_water():
    """Two quadrants of water touch only along a line; the open halves of the mesh faces there have equal
    area but lie apart."""
    for x, y in ((0.5, 0.5), (0.5 + H / 2, 0.5), (0.5 + H / 2, 0.5 + H / 2), (0.53, 0.47)):
        bodies = ConvexBodies.boxes([[x - 1, y + 1, 0.5], [x + 1, y - 1, 0.5]], [[2, 2, 4], [2, 2, 4]])
        domain = cut_domain(BOX, bodies, "multiple")
        assert components(domain.cells, len(domain.nodes)).max() == 1


def test_door_connects_and_slit_depends_on_the_thresholds():
    """A door two cells wide joins the two sides. A slit of 0.05 h does so by default; the thresholds for
    thin plates close it."""

    def parts(width, connection):
        low, high = 0.5 - width / 2, 0.5 + width / 2
        bodies = ConvexBodies.boxes(
            [[0.52, low / 2, 0.5], [0.52, (1 + high) / 2, 0.5]], [[0.3 * H, low, 2], [0.3 * H, 1 - high, 2]]
        )
        domain = cut_domain(MESH, bodies, "multiple", connection=connection)
        return components(domain.cells, len(domain.nodes)).max() + 1

    assert parts(2 * H, None) == 1
    assert parts(2 * H, SHARP) == 1
    assert parts(0.05 * H, None) == 1
    assert parts(0.05 * H, SHARP) == 2


def test_without_thin_solids_covers_are_single():
    """No bodies: the background itself. A half space of solid: the same cells, nodes inside it absent."""
    plain = cut_domain(MESH, ConvexBodies.empty(), "multiple")
    np.testing.assert_array_equal(plain.cells, MESH.cells)
    np.testing.assert_array_equal(plain.nodes, MESH.nodes)
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.1]).as_matrix()
    bodies = ConvexBodies.boxes([[0.5, 0.5, -1.5]], [[9, 9, 4]], turn[None])
    one, many = (
        cut_domain(MESH, bodies),
        cut_domain(MESH, bodies, "multiple", connection=Connection(pocket=0)),
    )
    np.testing.assert_array_equal(many.parent_node[many.cells], one.cells)
    np.testing.assert_array_equal(many.volume, one.volume)
    assert len(np.unique(many.parent_node)) == len(many.parent_node) < len(MESH.nodes)


def hollow_box(inner):
    """Six plates round a cavity of edge `inner` at the middle of the cube."""
    t = 0.5 * H
    centre, size = [], []
    for a in range(3):
        for s in (-1, 1):
            c, d = np.full(3, 0.5), np.full(3, inner + 2 * t)
            c[a] += s * (inner + t) / 2
            d[a] = t
            centre.append(c)
            size.append(d)
    return ConvexBodies.boxes(centre, size)


def test_closed_pockets():
    """A cavity of several cells is a component of its own; one below the limit is dropped with its faces."""
    large = cut_domain(MESH, hollow_box(2.5 * H), "multiple")
    volume = np.bincount(components(large.cells, len(large.nodes)), large.volume)
    assert volume.min() == pytest.approx((2.5 * H) ** 3, rel=1e-12)
    small = cut_domain(MESH, hollow_box(0.05 * H), "multiple")
    assert components(small.cells, len(small.nodes)).max() == 0
    outer = 1.05 * H
    assert small.face_area.sum() == pytest.approx(6 * outer**2, rel=1e-12)


def test_fields_stay_on_their_side_of_a_moving_plate():
    """A full plate 0.3 h thick moves four cells through the mesh: a node copy takes its values from its own
    side, or has no source where the plate has just uncovered it; the two sides never mix."""
    turn = Rotation.from_euler("yz", [0.2, -0.15]).as_matrix()
    reference = ConvexBodies.boxes([[0, 0, 0]], [[0.3 * H, 4, 4]])

    def at(x, previous=None):
        moved = None if previous is None else np.ones(1, dtype=bool)
        bodies = reference.moved([[x, 0.5, 0.5]], turn[None])
        return cut_domain(MESH, bodies, "multiple", previous=previous, moved=moved)

    def side(domain, x):
        cell = (domain.centroid - [x, 0.5, 0.5]) @ turn[:, 0] > 0
        node = np.zeros(len(domain.nodes))
        node[domain.cells] = cell[:, None]
        return node

    x = 0.3
    old = at(x)
    for _ in range(25):
        new = at(x + 0.02, old)
        source = carry(old, new)
        found = source >= 0
        assert found.mean() > 0.97
        np.testing.assert_array_equal(old.parent_node[source[found]], new.parent_node[found])
        np.testing.assert_array_equal(side(old, x)[source[found]], side(new, x + 0.02)[found])
        old, x = new, x + 0.02


def test_cutting_again_equals_a_full_cut():
    """Bit for bit with multiple covers too."""
    rng = np.random.default_rng(4)
    n = 20
    centre, size = rng.uniform(0, 1, (n, 3)), rng.uniform(0.02, 0.3, (n, 3))
    reference = ConvexBodies.boxes(centre, size)
    rotation = Rotation.random(n, rng=5).as_matrix()
    domain = cut_domain(MESH, reference.moved(centre, rotation), "multiple")
    for _ in range(4):
        moved = rng.random(n) < 0.4
        centre = centre + moved[:, None] * rng.normal(0, 0.05, (n, 3))
        bodies = reference.moved(centre, rotation)
        domain = cut_domain(MESH, bodies, "multiple", previous=domain, moved=moved)
        full = cut_domain(MESH, bodies, "multiple")
        for f in dataclasses.fields(full):
            if f.name != "memory":
                np.testing.assert_array_equal(getattr(domain, f.name), getattr(full, f.name))
