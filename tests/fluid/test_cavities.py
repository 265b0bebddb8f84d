"""Air on walls that the water has left: a layer as thick as the volume of the nodes says."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.moments import nodal_water
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.surface.cavities import LEAST_LACKING, air_on_walls, on_one_side

CELL = 0.1


@pytest.fixture(scope="module")
def over_a_block():
    """A block over the whole floor whose top lies on nodes, 0.3 m of water above it, the nodes of its top away from the
    sides of the tank, and their water."""
    mesh = box_mesh((0.0, 0.0, 0.0), (1.0, 0.8, 0.8), CELL)
    block = ConvexBodies.boxes([[0.5, 0.4, 0.1]], [[0.6, 0.5, 0.1]])
    t = Topology.of(mesh, cut_domain(mesh, block))
    x, phi = t.nodes, t.nodes[:, 2] - 0.5
    inside = (np.abs(x[:, 0] - 0.5) < 0.35) & (np.abs(x[:, 1] - 0.4) < 0.25)
    top = np.flatnonzero(inside & (np.abs(x[:, 2] - 0.2) < 1e-9))
    return t, phi, top, nodal_water(np.arange(len(t.cells)), 0.0, phi, t.parts, len(phi))


def test_the_layer_of_air_is_as_thick_as_the_volume_says(over_a_block):
    """Of a plane layer: its volume at the nodes of the wall is what they have."""
    t, phi, top, water = over_a_block
    reached = np.zeros(len(phi), bool)
    reached[top] = True
    for share in (0.9, 0.5, 0.2):
        held = water.copy()
        held[top] *= share
        found, layer = air_on_walls(t, phi, held, reached, top)
        thick = found[top]
        np.testing.assert_array_equal(np.flatnonzero(layer), top)
        # ∫ of the hat over the half line beyond the layer, over that of the whole
        np.testing.assert_allclose((1.0 - thick / CELL) ** 2, share, rtol=1e-12)
        others = np.setdiff1d(np.arange(len(phi)), top)
        np.testing.assert_array_equal(found[others], phi[others])


def test_walls_that_lack_no_water_or_that_no_air_reaches_keep_the_level_set(over_a_block):
    t, phi, top, water = over_a_block
    reached = np.zeros(len(phi), bool)
    less = water.copy()
    less[top] *= 0.5
    assert air_on_walls(t, phi, less, reached, top)[0] is phi
    reached[top] = True
    assert air_on_walls(t, phi, water, reached, top) == (phi, None)
    less = water - 0.9 * LEAST_LACKING * t.node_volume
    found, layer = air_on_walls(t, phi, less, reached, top)
    assert found is phi
    assert layer is None


@pytest.mark.parametrize(("thickness", "one_sided"), [(0.25 * CELL, False), (3.0 * CELL, True)])
def test_nodes_on_both_sides_of_a_thin_wall_are_left_out(thickness, one_sided):
    """One level set for both sides: the water of a full side and a dry one falls short of it, without a layer of air.
    Waves lost their load on the houses of a town whose walls are a sixth of a cell thick."""
    mesh = box_mesh((0.0, 0.0, 0.0), (1.0, 0.8, 0.8), CELL)
    wall = ConvexBodies.boxes([[0.53, 0.4, 0.4]], [[0.5 * thickness, 0.5, 0.5]])
    domain = cut_domain(mesh, wall)
    nodes = np.unique(domain.cells[domain.face_cell])
    inside = (np.abs(domain.nodes[nodes][:, 1:] - 0.4) < 0.25).all(axis=1)
    nodes = nodes[inside]
    found = on_one_side(domain, nodes)
    assert len(nodes) > 0
    assert len(found) == (len(nodes) if one_sided else 0)
