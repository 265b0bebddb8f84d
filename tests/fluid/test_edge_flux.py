"""Fluxes of the volume along edges on bricks of any shape."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.graph import Graph
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.surface.volume import edge_rates

BRICKS = 3


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
@pytest.mark.parametrize("sides", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.1), (0.1, 0.1, 1.0), (1.0, 0.1, 0.3)])
def test_a_stream_along_bricks_passes_through_their_faces_and_between_no_layers(sides, split):
    """Flat and tall bricks under a velocity along x that differs from layer to layer: what inner nodes get comes from
    the node behind and goes to the one ahead, and nothing goes along diagonals or to another layer. Through the planes
    of the medians a third went across, and on flat bricks the layer on the bed was mixed with the stream above it."""
    sides = np.asarray(sides)
    mesh = box_mesh(np.zeros(3), BRICKS * sides, sides, split=split)
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"))
    u = np.zeros((len(t.cells), 3))
    u[:, 0] = 1.0 + np.floor(t.nodes[t.cells].mean(axis=1)[:, 2] / sides[2])
    nodes = np.arange(len(t.nodes))
    graph = Graph.of(t, nodes)
    rate = edge_rates(t, graph, nodes, u) / (sides[1] * sides[2])
    place = np.round(t.nodes / sides).astype(int)
    inner = np.flatnonzero(((place > 0) & (place < BRICKS)).all(axis=1))
    assert len(inner) == (BRICKS - 1) ** 3
    for i in inner:
        some = slice(graph.start[graph.row[i]], graph.start[graph.row[i] + 1])
        way = place[graph.neighbour[some]] - place[i]
        along = (way[:, 1:] == 0).all(axis=1)
        np.testing.assert_allclose(rate[some][~along], 0.0, atol=1e-12)
        assert (way[along, 0] * rate[some][along]).min() > 0.5
        assert rate[some].sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
@pytest.mark.parametrize("slope", [0.05, 0.15])
def test_a_stream_down_a_bed_that_the_mesh_follows_stays_in_its_layers(split, slope):
    """Layers of flat bricks that are sheared by a slope, so that nine tenths of their cells are obtuse: water that runs
    along them passes from node to node along the sides of the bricks, and what every node gets, it passes on. Through
    the planes of the medians twice as much as went along the layers went across."""
    fitted = fitted_mesh((0, 0, -2), (8, 4, 2), (1, 0.5, 0.5), lambda x, _: -2.0 + slope * x, split=split)
    mesh, place = fitted.mesh, fitted.lattice
    assert mesh.is_obtuse
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"))
    nodes, top = np.arange(len(t.nodes)), place.max(axis=0)
    lowest = np.floor(place[t.cells].min(axis=1)[:, 2])
    u = np.outer(1.0 + lowest, [1.0, 0.0, slope])
    graph = Graph.of(t, nodes)
    rate = edge_rates(t, graph, nodes, u)
    inner = np.flatnonzero(((place > 0) & (place < top - 1.0)).all(axis=1) & (place[:, 2] < 4.0))
    assert len(inner) > 50
    for i in inner:
        some = slice(graph.start[graph.row[i]], graph.start[graph.row[i] + 1])
        way = place[graph.neighbour[some]] - place[i]
        along = (way[:, 1:] == 0).all(axis=1)
        np.testing.assert_allclose(rate[some][~along], 0.0, atol=1e-12)
        assert (way[along, 0] * rate[some][along]).min() > 0.0
        assert rate[some].sum() == pytest.approx(0.0, abs=1e-12)
