"""Distance to the surface: exact for planes, Eikonal near a sphere, the surface itself untouched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.surface.closest_triangles import squared_distance
from fluid.surface.level_set import FAR, no_steeper, redistance
from fluid.surface.shift import NOBODY, ShiftRows
from fluid.surface.volume import nodal_volume
from kernels.decorators import plain

H = 0.1


@plain
def _square(p, t):
    """`squared_distance`, which only kernels can call."""
    return squared_distance(p, t)


@pytest.fixture(scope="module")
def cube():
    mesh = box_mesh(np.zeros(3), np.ones(3), H)
    return Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty()))


def test_level_plane_is_kept_and_cut_off(cube):
    z = cube.nodes[:, 2] - 0.43
    phi = redistance(cube, 3.0 * z, H, rescale=True)
    near = np.abs(z) < 5 * H
    np.testing.assert_allclose(phi[near], z[near], atol=1e-12)
    assert np.abs(phi).max() <= FAR * H


def test_sphere_distance_and_volume(cube):
    r = np.linalg.norm(cube.nodes - 0.5, axis=1) - 0.32
    phi = redistance(cube, r, H, rescale=False)
    np.testing.assert_allclose(phi, r, atol=0.25 * H)
    before, after = nodal_volume(cube, r).sum(), nodal_volume(cube, phi).sum()
    np.testing.assert_allclose(after, before, rtol=1e-12)
    np.testing.assert_allclose(after, 4 / 3 * np.pi * 0.32**3, rtol=0.06)


def test_plane_goes_on_inside_a_bed_past_a_layer_of_nodes():
    """A tenth of a cell below a layer of nodes where the bed, which climbs through it, ends the cells of the surface:
    the nodes of that layer inside the bed lay a cell and more from the last polygon."""
    mesh, slope, layer = box_mesh([0, 0, 0], [3.0, 0.2, 0.4], H), 0.2, 0.2
    corners = np.array(
        [(x, y, z) for x, z in ((0.25, 0.0), (4.0, 0.0), (4.0, 3.75 * slope)) for y in (-1.0, 1.2)]
    )
    bed = ConvexBodies.from_polyhedra([(corners, None)])
    t = Topology.of(mesh, cut_domain(mesh, bed))
    z = t.nodes[:, 2] - layer + 0.01
    at_rest = (np.zeros_like(t.nodes), 9.81)
    phi = redistance(t, np.where(t.active, z, FAR * H), H, rescale=False, motion=at_rest)
    foot = 0.25 + layer / slope
    last = np.isclose(t.nodes[:, 2], layer) & t.covered & t.active & (t.nodes[:, 0] < foot + 2 * H)
    assert last.sum() >= 3
    np.testing.assert_allclose(phi[last], z[last], atol=1e-12)


coordinate = st.floats(-1, 1)
point = st.tuples(coordinate, coordinate, coordinate)


@settings(deadline=None)  # the first call compiles
@given(point, st.tuples(point, point, point))
def test_distance_to_a_triangle_against_sampling(p, corners):
    """Never above the distance to any of its points, and reached to within the spacing of the samples."""
    t, p = np.array(corners), np.array(p)
    a, b = np.meshgrid(np.linspace(0, 1, 25), np.linspace(0, 1, 25))
    inside = a + b <= 1 + 1e-12
    samples = t[0] + a[inside][:, None] * (t[1] - t[0]) + b[inside][:, None] * (t[2] - t[0])
    nearest = np.linalg.norm(samples - p, axis=1).min()
    found = np.sqrt(_square(p, t))
    assert found <= nearest + 1e-7
    assert found >= nearest - 0.13


def test_a_start_is_as_flat_as_a_distance(cube):
    """Dry nodes among wet ones and wet ones among dry ones that lie farther off by their value than their neighbours on
    the other side are: nodes of pockets between stones. A plane keeps its bits, and so does what a side gives."""
    plane = cube.nodes[:, 2] - 0.43
    free, given = np.zeros(len(plane), bool), np.ones(len(plane), bool)
    assert (no_steeper(cube, plane, free) == plane).all()
    near = np.hypot(*(cube.nodes[:, :2] - 0.5).T) < 0.01
    level = np.where(near & (np.abs(plane) < H), -np.sign(plane) * 2 * H, plane)
    assert (no_steeper(cube, level, given) == level).all()
    flat = no_steeper(cube, level, free)
    assert (np.sign(flat) == np.sign(level)).all()
    assert (np.abs(flat) <= np.abs(level)).all()
    changed = cube.nodes[flat != level]
    beside = np.linalg.norm(changed[:, None] - cube.nodes[level != plane], axis=2).min(axis=1)
    assert beside.max() < 1.8 * H
    a, b = cube.cells[:, [0, 0, 0, 1, 1, 2]].ravel(), cube.cells[:, [1, 2, 3, 2, 3, 3]].ravel()
    over = np.flatnonzero((flat[a] < 0.0) != (flat[b] < 0.0))
    a, b = a[over], b[over]
    assert (
        np.abs(flat[a]) + np.abs(flat[b]) <= 1.1 * np.linalg.norm(cube.nodes[a] - cube.nodes[b], axis=1)
    ).all()


@pytest.fixture(scope="module")
def beach():
    """A bed of 1:20 with layers that follow it; the topology, and the nodes on the bed (N,) bool."""
    fitted = fitted_mesh((0, 0, 0), (4.0, 0.3, 0.6), (0.1, 0.1, 0.05), lambda x, y: x / 20)
    return Topology.of(fitted.mesh, cut_domain(fitted.mesh, ConvexBodies.empty())), fitted.on_bed


def at_tip(topology, on_bed, tip):
    """Nodes (N,) bool on the bed in the column before and after x = tip [m]."""
    x = topology.nodes[:, 0]
    return on_bed & (x < tip) & (x > tip - H), on_bed & (x > tip) & (x < tip + H)


def test_a_thin_tongue_ends_where_its_plane_meets_the_bed(beach):
    """Its last node is 5 mm below the surface, the second one ahead of it 15 mm above its plane and 0.15 m from its
    end: with that distance the surface stands upright beside the last wet node once the tip gets there."""
    t, on_bed = beach
    tip, tangent = 2.05, 0.1
    plane = t.nodes[:, 2] - t.nodes[:, 0] / 20 + tangent * (t.nodes[:, 0] - tip)
    plane /= np.linalg.norm([tangent - 0.05, 1.0])
    at_rest = (np.zeros_like(t.nodes), 9.81)
    phi = redistance(t, plane, t.node_size, rescale=False, motion=at_rest)
    wet, dry = at_tip(t, on_bed, tip)
    np.testing.assert_allclose(phi[wet | dry], plane[wet | dry])
    _, ahead = at_tip(t, on_bed, tip + H)
    assert ahead.sum() == 4
    np.testing.assert_allclose(phi[ahead], plane[ahead], rtol=0.02)


def test_a_dry_node_before_a_thin_tongue_does_not_grow(beach):
    """Water 5 mm deep before a node on the bed at which φ is 50 mm, and hardly more above it: the mean slope there is
    below 0.9. In fast water it is restored as elsewhere."""
    t, on_bed = beach
    _, dry = at_tip(t, on_bed, 2.05)
    height = t.nodes[:, 2] - t.nodes[:, 0] / 20
    phi = np.where(t.nodes[:, 0] < 2.05, height - 0.005, 0.05 + 0.3 * height)
    at_rest, fast = np.zeros_like(t.nodes), np.full_like(t.nodes, 2.0)
    again = redistance(t, phi, t.node_size, rescale=True, motion=(at_rest, 9.81))
    assert dry.sum() == 4
    np.testing.assert_array_equal(again[dry], phi[dry])
    assert (redistance(t, phi, t.node_size, rescale=True, motion=(fast, 9.81))[dry] > 1.1 * phi[dry]).all()


def test_a_splash_over_a_bed_keeps_its_distance(beach):
    """In fast water the plane of the surface is not that of the next cell."""
    t, on_bed = beach
    plane = t.nodes[:, 2] - t.nodes[:, 0] / 20 + 0.1 * (t.nodes[:, 0] - 2.05)
    _, ahead = at_tip(t, on_bed, 2.15)
    slow, fast = (
        redistance(t, plane, t.node_size, rescale=False, motion=(np.full_like(t.nodes, u), 9.81))[ahead]
        for u in (0.0, 2.0)
    )
    assert (slow < 0.2 * fast).all()
    np.testing.assert_array_equal(fast, redistance(t, plane, t.node_size, rescale=False)[ahead])


def test_only_gentle_slopes_count_as_beds():
    """Sides of a basin: a slope of 1:20 is a bed, one of 3:2 and level ground are not."""
    mesh = fitted_mesh(
        (0, 0, 0),
        (4.0, 0.3, 2.0),
        (0.1, 0.1, 0.1),
        lambda x, y: np.maximum(np.maximum(x - 1.0, 0.0) / 20, 1.5 * (x - 3.5)),
    ).mesh
    x, z = mesh.nodes[:, 0], mesh.nodes[:, 2]
    steep = np.isclose(z, 1.5 * (x - 3.5)) & (x > 3.75)
    assert mesh.slanting[steep].all()
    assert not mesh.sloping_bed[steep].any()
    gentle = np.isclose(z, (x - 1.0) / 20) & (x < 3.5) & (x > 0.95)
    assert mesh.sloping_bed[gentle].all()
    assert not mesh.sloping_bed[~gentle & (x < 3.5)].any()


def test_the_correction_of_the_volume_does_not_jump_with_the_number_of_its_steps():
    """A chain of 200 unknowns, for tolerances that differ by 0.2 %: with the last step of conjugate gradients as a
    whole, one step more changed the result by up to 4.5 % of it."""
    n, rng = 200, np.random.default_rng(2)
    residual = rng.normal(size=n)
    links = [[j for j in (i - 1, i + 1) if 0 <= j < n] for i in range(n)]
    first = np.cumsum([0] + [len(row) for row in links]).astype(np.uint32)
    column = np.concatenate(links).astype(np.uint32)

    def solved(tolerance):
        diagonal = 0.3 + np.diff(first).astype(float)
        return ShiftRows(first, column, np.full(len(column), -1.0), diagonal, NOBODY).shift(
            residual, tolerance, 100
        )

    found = np.array([solved(tolerance) for tolerance in 10.0 ** np.arange(-1.0, -3.0, -0.001)])
    jump = np.abs(np.diff(found, axis=0)).max() / np.abs(found[-1]).max()
    assert jump < 5e-4, jump
    assert np.abs(found[-1] - solved(1e-10)).max() < 5e-3 * np.abs(found[-1]).max()
