"""Cells that the surface cannot reach, and those that it can, found from the nodes."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.moments import nodal_water
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.surface import volume
from fluid.surface.level_set import surface_cells

MOST = 0.4


@pytest.fixture(scope="module")
def topology():
    mesh = box_mesh((0.0, 0.0, 0.0), (1.0, 0.8, 0.6), 0.1)
    return Topology.of(mesh, cut_domain(mesh, ConvexBodies.boxes([[0.42, 0.43, 0.21]], [[0.33, 0.31, 0.27]])))


def _wavy(x):
    return x[:, 2] - 0.33 + 0.13 * np.sin(9.0 * x[:, 0]) * np.cos(7.0 * x[:, 1])


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_the_water_of_whole_cells_is_the_sum_over_them_to_the_last_bit(topology, share):
    """Also where only some of the nodes are to be looked at."""
    t, phi = topology, _wavy(topology.nodes)
    seen = np.random.default_rng(3).random(len(phi)) < share
    listed = seen[t.cells].any(axis=1)
    reach = MOST * t.node_size[t.cells]
    whole = np.flatnonzero(listed & (phi[t.cells] < -reach).all(axis=1))
    beyond = (phi[t.cells] >= reach).all(axis=1)
    inner, near = volume._parted(t, seen, phi, MOST, t.node_size)
    np.testing.assert_array_equal(inner, nodal_water(whole, 0.0, phi, t.parts, len(phi)))
    expected = listed & ~beyond
    expected[whole] = False
    np.testing.assert_array_equal(near, np.flatnonzero(expected))
    assert len(whole) > 100


def test_cells_of_the_surface_have_water_on_one_corner_and_air_on_another(topology):
    t, phi = topology, _wavy(topology.nodes)
    wet = (phi[t.cells] < 0.0).sum(axis=1)
    np.testing.assert_array_equal(surface_cells(phi, t), np.flatnonzero((wet > 0) & (wet < 4)))
