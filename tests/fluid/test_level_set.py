"""Distance to the surface: exact for planes, Eikonal near a sphere, the surface itself untouched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.surface.level_set import FAR, no_steeper, redistance, squared_distance
from fluid.surface.volume import nodal_volume

H = 0.1


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
    found = np.sqrt(squared_distance(p, t))
    assert found <= nearest + 1e-7
    assert found >= nearest - 0.13


def test_a_start_is_as_flat_as_a_distance(cube):
    """Dry nodes among wet ones and wet ones among dry ones that lie farther off by their value than their neighbours on
    the other side are: nodes of pockets between stones. A plane keeps its bits."""
    plane = cube.nodes[:, 2] - 0.43
    assert (no_steeper(cube, plane) == plane).all()
    near = np.hypot(*(cube.nodes[:, :2] - 0.5).T) < 0.01
    level = np.where(near & (np.abs(plane) < H), -np.sign(plane) * 2 * H, plane)
    flat = no_steeper(cube, level)
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
