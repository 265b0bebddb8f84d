"""Fluxes of the volume along edges on bricks of any shape."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Graph, Topology
from fluid.mesh.background import box_mesh
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
